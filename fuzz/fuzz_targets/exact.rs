//! Any ray and any triangle: the arbiter's filter and boxes say what rational numbers say, and the
//! kernels' test takes it without panic.
#![no_main]

use sato::arbiter::{Arbiter, exact_hits, hits, is_ray};
use sato::geometry::{Triangle, TriangleMesh, Vec3};
use sato::intersect::PreparedRay;
use sato::ray::Ray;

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
    let tree = (sato::build::BUILDERS[0].build)(&mesh);
    let arbiter = Arbiter::new(&tree);
    assert_eq!(arbiter.occluded(&ray), truth);
    assert_eq!(arbiter.explain(&ray).occluded, truth);
    // The fast test may be wrong; the exact one, when it is here, is to be held to `truth`.
    if let Some(prepared) = PreparedRay::new(&ray, &triangle.bounds()) {
        let _ = prepared.triangle(&triangle);
    }
});
