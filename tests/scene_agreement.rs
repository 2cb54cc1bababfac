//! Every native backend answers the recorded rays of real views as brute force does: all builders,
//! orders and kernels on generated scenes.

mod common;

use common::every_spec;
use sato::lab::Lab;
use sato::measure::trace;
use sato::render::{Pass, RenderSettings, record};
use sato::scene;

#[test]
fn all_orders_trees_and_kernels_agree_on_recorded_rays() {
    for (name, size) in [("ship", [64, 36]), ("mad-science", [24, 14])] {
        let scene = scene::load(name).unwrap();
        let lab = Lab::new(&scene, 1);
        let settings = RenderSettings {
            size,
            spp: 2,
            passes: Pass::all_of(&scene),
            ..RenderSettings::of_scene(&scene)
        };
        let build = |spec: &str| lab.build(&spec.parse().unwrap()).unwrap();
        let recording = record(&scene, &*build("bvh2"), &settings, None).unwrap();
        let brutes = ["fast", "exact"].map(|mode| (mode, build(&format!("brute:mode={mode}"))));
        let mut occluded = 0;
        let mut passes = Vec::new();
        for pass in recording.passes() {
            for (mode, brute) in &brutes {
                let mut expected = pass.rays().no_answers();
                trace(&**brute, pass.rays(), &mut expected);
                occluded += sato::ray_set::occluded_count(&expected);
                passes.push((*mode, pass.rays(), expected));
            }
        }
        let specs = every_spec();
        for spec in specs.iter().filter(|s| !["brute", "embree"].contains(&s.name())) {
            let backend = lab.build(spec).unwrap();
            let of_mode = passes.iter().filter(|(mode, ..)| spec.value("mode") == *mode);
            for (_, set, expected) in of_mode {
                let mut answers = set.no_answers();
                trace(&*backend, set, &mut answers);
                let differing = set.differing(expected, &answers);
                assert!(differing.is_empty(), "{name}, {spec}: rays {differing:?}");
            }
        }
        assert!(occluded > 600, "{name}: {occluded}");
    }
}
