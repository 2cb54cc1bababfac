//! Any ray and any triangle: the arbiter's filter and boxes say what rational numbers say, and so do
//! all kernels in exact mode; the plain test takes it without panic.
#![no_main]

use sato::arbiter::{Arbiter, exact_hits, hits, is_ray};
use sato::build::{BUILDERS, Leaves, WideCosts, collapse};
use sato::geometry::{Triangle, TriangleMesh, Vec3};
use sato::intersect::{Exact, Mode, PreparedRay};
use sato::ray::Ray;
use sato::trace::wide::{self, Instructions, Query, Scratch, Way};
use sato::trace::{NoCount, single};
use sato::tree::Plan;

/// Numbers of 4 bytes, or of one for small whole ones, so that exact cases are found.
fn numbers(data: &[u8]) -> Option<[f32; 17]> {
    let (kind, data) = data.split_first()?;
    let mut numbers = [0.0; 17];
    if kind & 1 == 0 {
        for (number, bytes) in numbers.iter_mut().zip(data.chunks_exact(4)) {
            *number = f32::from_le_bytes(bytes.try_into().ok()?);
        }
        (data.len() >= 68).then_some(numbers)
    } else {
        let scale = 2f32.powi(i32::from(*kind >> 1) - 64);
        for (number, byte) in numbers.iter_mut().zip(data) {
            *number = f32::from(*byte as i8) * scale;
        }
        (data.len() >= 17).then_some(numbers)
    }
}

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let Some(n) = numbers(data) else { return };
    let point = |i: usize| Vec3::new(n[i], n[i + 1], n[i + 2]);
    let ray = Ray { origin: point(0), direction: point(3), t_min: n[6], t_max: n[7] };
    let triangle = Triangle([point(8), point(11), point(14)]);
    // As of every triangle of a scene that was loaded.
    if triangle.0.iter().any(|v| !v.is_finite() || v.abs().max_element() > 1e18) {
        return;
    }
    let truth = is_ray(&ray) && exact_hits(&ray, &triangle);
    assert_eq!(hits(&ray, &triangle), truth);
    let mesh = TriangleMesh::new(triangle.0.to_vec(), vec![[0, 1, 2]]);
    let tree = (BUILDERS[0].build)(&mesh, Leaves::Wide);
    let arbiter = Arbiter::new(&tree);
    assert_eq!(arbiter.occluded(&ray), truth);
    assert_eq!(arbiter.explain(&ray).occluded, truth);
    let prepared = PreparedRay::new(&ray, &mesh.bounds());
    assert_eq!(prepared.is_some_and(|ray| ray.hits_exactly(&triangle).0), truth);
    assert_eq!(single::any_hit(&tree, &Plan::Near, Exact, &ray, &mut NoCount), truth);
    let wide = collapse(&tree, WideCosts::default(), |_, _| 0.0);
    let rays = [ray; 20];
    for instructions in Instructions::all() {
        for way in [Way::Single, Way::Stream] {
            let query = Query { tree: &wide, mesh: &mesh, way, mode: Mode::Exact };
            let mut answers = [0];
            wide::any_hit(instructions, &query, &rays, &mut answers, &mut Scratch::default());
            assert_eq!(answers[0], if truth { (1 << rays.len()) - 1 } else { 0 });
        }
    }
    if let Some(prepared) = prepared {
        let _ = prepared.triangle(&triangle);
    }
});
