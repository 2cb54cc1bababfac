//! The same rays in other batches: what a kernel can gain from neighbours depends on who these are.

use crate::ray::Ray;
use crate::ray_set::RaySet;
use crate::render::sampler::mix;
use crate::render::{RayClass, Recording, TILE_PIXELS};

/// A way to put recorded rays into batches.
pub(super) struct Arrangement {
    pub(super) name: &'static str,
    /// What it is, in a few words.
    pub(super) about: &'static str,
    /// All rays of a pass of a recording, from a seed.
    pub(super) arrange: fn(&Recording, usize, u64) -> RaySet,
}

/// From most to least coherent.
pub(super) static ARRANGEMENTS: [Arrangement; 3] = [
    Arrangement {
        name: "tiles",
        about: "as rendered, a batch for each 8x8 tile and light",
        arrange: |recording, pass, _| recording.passes()[pass].rays().clone(),
    },
    Arrangement {
        name: "scanlines",
        about: "row by row, a batch for each 64 pixels and light",
        arrange: scanlines,
    },
    Arrangement {
        name: "shuffled",
        about: "in random order, in batches of the tiles' mean size",
        arrange: shuffled,
    },
];

/// As many pixels as a tile has, but side by side.
const SEGMENT: u32 = TILE_PIXELS as u32;

fn scanlines(recording: &Recording, pass: usize, _: u64) -> RaySet {
    let rays = recording.passes()[pass].rays().rays();
    // Row, segment and light are a batch's; rays of a pixel stay in the order of the recording.
    let place = |&ray: &usize| {
        let [x, y] = recording.pixel(pass, ray);
        let light = match recording.class(pass, ray) {
            RayClass::Shadow { light } => light,
            _ => 0,
        };
        ([y as usize, (x / SEGMENT) as usize, light], x)
    };
    let mut sorted: Vec<usize> = (0..rays.len()).collect();
    sorted.sort_by_cached_key(place);
    let mut set = RaySet::default();
    for batch in sorted.chunk_by(|a, b| place(a).0 == place(b).0) {
        set.push_batch(&batch.iter().map(|&ray| rays[ray]).collect::<Vec<Ray>>());
    }
    set
}

fn shuffled(recording: &Recording, pass: usize, seed: u64) -> RaySet {
    let recorded = recording.passes()[pass].rays();
    let rays = recorded.rays();
    let mut order: Vec<usize> = (0..rays.len()).collect();
    // Keys of different rays differ, as `mix` is a bijection.
    order.sort_by_cached_key(|&ray| mix(mix(seed) ^ ray as u64));
    let size = rays.len().div_ceil(recorded.batches().len().max(1)).max(1);
    let mut set = RaySet::default();
    for batch in order.chunks(size) {
        set.push_batch(&batch.iter().map(|&ray| rays[ray]).collect::<Vec<Ray>>());
    }
    set
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::Lab;
    use crate::render::{Pass, RenderSettings, record};
    use crate::scene;

    /// Wider than a segment, with both sides no multiple of a tile's.
    const SIZE: [u32; 2] = [150, 21];

    fn recording() -> Recording {
        let scene = scene::load("ship").unwrap();
        let tracer = Lab::new(&scene, 0).build(&"bvh2".parse().unwrap()).unwrap();
        let passes = Pass::all_of(&scene);
        let settings =
            RenderSettings { size: SIZE, spp: 2, passes, ..RenderSettings::of_scene(&scene) };
        record(&scene, &*tracer, &settings, None).unwrap()
    }

    /// The bits of all rays, sorted: equal for the same rays in any order.
    fn sorted(set: &RaySet) -> Vec<[u32; 8]> {
        let bits = |ray: &Ray| {
            let ([a, b, c], [d, e, f]) = (ray.origin.to_array(), ray.direction.to_array());
            [a, b, c, d, e, f, ray.t_min, ray.t_max].map(f32::to_bits)
        };
        let mut all: Vec<_> = set.rays().iter().map(bits).collect();
        all.sort_unstable();
        all
    }

    #[test]
    fn all_have_the_same_rays_in_batches_of_like_size() {
        let recording = recording();
        for (index, pass) in recording.passes().iter().enumerate() {
            let recorded = pass.rays();
            assert!(recorded.len() > 500, "{:?}: {}", pass.pass(), recorded.len());
            for arrangement in &ARRANGEMENTS {
                let set = (arrangement.arrange)(&recording, index, 7);
                let name = arrangement.name;
                assert_eq!(sorted(&set), sorted(recorded), "{name}");
                assert_eq!(set.rays() == recorded.rays(), name == "tiles", "{name}");
                let most = set.batches().map(|batch| batch.rays.len()).max().unwrap();
                let lights = recording.settings().spp as usize * TILE_PIXELS;
                assert!(most <= lights, "{name}: {most} rays in a batch");
                let batches = set.batches().len() as f64 / recorded.batches().len() as f64;
                assert!((0.5..2.0).contains(&batches), "{name}: {batches} as many batches");
            }
        }
    }

    #[test]
    fn scanlines_go_row_by_row() {
        let recording = recording();
        for pass in 0..recording.passes().len() {
            let rays = recording.passes()[pass].rays().rays();
            let pixel_of = |ray: &Ray| {
                let [x, y] = recording.pixel(pass, rays.iter().position(|r| r == ray).unwrap());
                [y, x / SEGMENT]
            };
            let set = scanlines(&recording, pass, 0);
            let batches: Vec<[u32; 2]> = set
                .batches()
                .map(|batch| {
                    let first = pixel_of(&batch.rays[0]);
                    assert!(batch.rays.iter().all(|ray| pixel_of(ray) == first));
                    first
                })
                .collect();
            assert!(batches.is_sorted() && batches.len() > SIZE[1] as usize / 2);
        }
    }

    #[test]
    fn the_seed_decides_how_rays_are_shuffled() {
        let recording = recording();
        let first = shuffled(&recording, 0, 1);
        assert_eq!(first, shuffled(&recording, 0, 1));
        assert_ne!(first, shuffled(&recording, 0, 2));
    }
}
