//! Every native backend answers the recorded rays of real views as brute force does: all builders,
//! orders and kernels on generated scenes.

mod common;

use common::all_specs;
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
        let (brute, specs) = (build("brute"), all_specs());
        let mut occluded = 0;
        for pass in recording.passes() {
            let set = pass.rays();
            let mut expected = set.no_answers();
            trace(&*brute, set, &mut expected);
            occluded += sato::ray_set::occluded_count(&expected);
            for spec in specs.iter().filter(|s| !["brute", "embree"].contains(&s.name())) {
                let mut answers = set.no_answers();
                trace(&*lab.build(spec).unwrap(), set, &mut answers);
                let differing = set.differing(&expected, &answers);
                assert!(differing.is_empty(), "{name}, {spec}: rays {differing:?}");
            }
        }
        assert!(occluded > 300, "{name}: {occluded}");
    }
}
