//! How long each order takes on one thread, on the two-million-triangle scene of the paper's table or
//! on the generators named: `cargo run --release --example order_times [GENERATOR...]`. On Linux the
//! time is that of the processor, so that other work on the machine counts less.

use sato::build;
use sato::geometry::{TriangleMesh, Vec3};
use sato::measure::{Summary, interleaved};
use sato::order::{ORDERS, OrderContext};
use sato::ray::Ray;
use sato::ray_set::RaySet;
use sato::scene::generate;
use std::time::Instant;

const ROUNDS: usize = 5;

fn main() {
    let mut names: Vec<String> = std::env::args().skip(1).collect();
    if names.is_empty() {
        names.push("shadow-overlap".into());
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    for name in names {
        let generator = generate::find(&name).unwrap_or_else(|| panic!("no generator '{name}'"));
        let mesh = (generator.generate)(0).mesh;
        pool.install(|| report(&name, &mesh));
    }
}

fn report(name: &str, mesh: &TriangleMesh) {
    let tree = (build::find("binned").expect("the default builder").build)(mesh);
    println!("{name}: {} triangles, {} inner nodes, one thread", mesh.len(), tree.nodes.len());
    let training = rays(mesh);
    let context = OrderContext { training: Some(&training), ..OrderContext::new(mesh) };
    let times = interleaved(ORDERS.len(), ROUNDS, |order| {
        let (start, start_cpu) = (Instant::now(), cpu_ms());
        let _plan = (ORDERS[order].plan_bvh2)(&tree, &context);
        let elapsed = start.elapsed().as_secs_f64() * 1e3;
        match (start_cpu, cpu_ms()) {
            (Some(start), Some(end)) => end - start,
            _ => elapsed,
        }
    });
    println!("{:22} {:>10} {:>10} {:>10}", "order", "median ms", "min ms", "ns/node");
    for (order, times) in ORDERS.iter().zip(&times) {
        let ms = Summary::of(times);
        let per_node = ms.min * 1e6 / tree.nodes.len() as f64;
        println!("{:22} {:10.2} {:10.2} {per_node:10.1}", order.name, ms.median, ms.min);
    }
}

/// Time that this thread has spent on a processor, in milliseconds.
fn cpu_ms() -> Option<f64> {
    // The count is brought up to date whenever the thread gives the processor back.
    std::thread::yield_now();
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    stat.split(' ').next()?.parse::<f64>().ok().map(|ns| ns * 1e-6)
}

/// From triangles towards random points of the scene's box.
fn rays(mesh: &TriangleMesh) -> RaySet {
    // SplitMix64 (Steele, Lea and Flood, 2014), to [0, 1).
    let mut state = 2u64;
    let mut unit = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u32 << 24) as f32
    };
    let bounds = mesh.bounds();
    let rays: Vec<Ray> = (0..20_000)
        .map(|_| {
            let index = (unit() * mesh.len() as f32) as usize;
            let origin = mesh.triangle(index.min(mesh.len() - 1)).bounds().center();
            let target = bounds.min + bounds.size() * Vec3::new(unit(), unit(), unit());
            Ray::new(origin, target - origin, 1.0)
        })
        .collect();
    let mut set = RaySet::default();
    set.push_batch(&rays);
    set
}
