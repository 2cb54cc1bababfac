//! The scene files of this repository, and the real meshes behind them where they are at hand.

use sato::geometry::Aabb;
use sato::scene::generate::{GENERATORS, MANY_TRIANGLES, find};
use sato::scene::{Scene, SceneInfo, export, load};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn scenes_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes")
}

/// The scene, or none and a word why if its meshes were not fetched.
fn load_or_skip(path: &Path) -> Option<Scene> {
    match load(path) {
        Ok(scene) => Some(scene),
        Err(error @ sato::Error::MissingMesh { .. }) => {
            eprintln!("skipped: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// What is known of the meshes: triangles, vertices, degenerate (of the
/// vertices as rounded to `f32`), duplicates, median and largest area.
struct Known(&'static str, usize, usize, usize, usize, f64, f64);

const KNOWN: &[Known] = &[
    Known("sponza_crytek", 262_267, 145_049, 1, 70, 20.16, 3.922e6),
    Known("sponza_dabrovic", 66_447, 35_013, 1, 9, 0.002971, 144.2),
    Known("sibenik", 73_564, 39_461, 10, 205, 0.008499, 61.2),
    Known("aggressor", 3_300, 1_681, 5, 20, 0.8839, 71.5),
    Known("dream_apartment", 177_934, 95_844, 0, 46, 4.864e-6, 13.31),
    Known("country_kitchen", 1_021_815, 517_503, 219, 6, 1.329e-6, 29.93),
    Known("crowd_koth", 170_928, 98_106, 149, 10, 0.001185, 199.0),
];

#[test]
fn every_scene_file_is_well_formed() {
    let mut names = BTreeSet::new();
    for file in std::fs::read_dir(scenes_folder()).unwrap() {
        let path = file.unwrap().path();
        if path.extension().is_none_or(|e| e != "toml") {
            continue;
        }
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let generator = find(&name);
        names.insert(name);
        if generator.is_some_and(|entry| entry.triangles > MANY_TRIANGLES) {
            continue;
        }
        let Some(scene) = load_or_skip(&path) else { continue };
        assert!(!scene.mesh.is_empty(), "{}", scene.name);
        assert!(!scene.lights.is_empty(), "{}", scene.name);
        assert_eq!(scene.warnings, [""; 0], "{}", scene.name);
        let sees = scene.mesh.bounds().contains(&Aabb::of_points([scene.camera.look_at]));
        assert!(sees, "{}: the camera looks at a point outside the scene", scene.name);
    }
    let missing = KNOWN.iter().find(|known| !names.contains(known.0)).map(|known| known.0);
    assert_eq!(missing, None);
}

#[test]
fn real_meshes_are_what_is_known_of_them() {
    for &Known(name, triangles, vertices, degenerate, duplicates, area_median, area_max) in KNOWN {
        let path = scenes_folder().join(name).with_extension("toml");
        let Some(scene) = load_or_skip(&path) else { continue };
        let info = SceneInfo::of(&scene);
        assert_eq!(
            (info.name.as_str(), info.triangles, info.vertices),
            (name, triangles, vertices)
        );
        let defects = (info.degenerate_triangles, info.duplicate_triangles);
        assert_eq!(defects, (degenerate, duplicates), "{name}");
        let near = |a: Option<f64>, b: f64| (a.unwrap() / b - 1.0).abs() < 1e-3;
        assert!(near(info.area_median, area_median), "{name}: {:?}", info.area_median);
        assert!(near(info.area_max, area_max), "{name}: {:?}", info.area_max);
    }
}

#[test]
fn exported_meshes_read_back_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let odd = folder.path().join("odd.obj");
    let numbers = "v 1e-42 -0 16777217\nv 0.1 1e17 -3.4e-30\nv 1 2 3\nv 4 5 6\nf 1 2 3 4\n";
    std::fs::write(&odd, numbers).unwrap();
    for scene in [Some(load(&odd).unwrap()), load_or_skip(&scenes_folder().join("aggressor.toml"))]
    {
        let Some(scene) = scene else { continue };
        for name in ["copy.obj", "sub/copy.obj.zst"] {
            let copy = folder.path().join(name);
            export(&scene, &copy).unwrap();
            let again = load(&copy).unwrap();
            let bits = |scene: &Scene| -> Vec<_> {
                let triangles = 0..scene.mesh.len();
                triangles
                    .map(|i| scene.mesh.triangle(i).0.map(|v| v.to_array().map(f32::to_bits)))
                    .collect()
            };
            assert!(bits(&again) == bits(&scene), "{name}");
            assert_eq!(again.mesh.vertices().len(), scene.mesh.vertices().len());
        }
    }
    let refused = export(&load(&odd).unwrap(), folder.path().join("x.ply")).unwrap_err();
    assert_eq!(refused.exit_status(), 2);
}

#[test]
fn a_generators_view_and_lights_move_with_its_triangles() {
    let folder = tempfile::tempdir().unwrap();
    // The smallest will do: what is at stake is the same for all.
    let Some(entry) = GENERATORS.iter().min_by_key(|entry| entry.triangles) else { return };
    let plain = load(entry.name).unwrap();
    let path = folder.path().join("moved.toml");
    let entry = format!("[[geometry]]\ngenerator = '{}'\n", plain.name);
    std::fs::write(&path, &entry).unwrap();
    let same = load(&path).unwrap();
    assert_eq!(same.mesh.vertices(), plain.mesh.vertices());
    assert_eq!((same.camera, &same.lights), (plain.camera, &plain.lights));
    assert_eq!(same.defaults, plain.defaults);

    std::fs::write(&path, entry + "scale = 2\ntranslate = [10, 0, 0]\n").unwrap();
    let moved = load(&path).unwrap();
    let near = |a: sato::geometry::Vec3, b: sato::geometry::Vec3| a.distance(b) < 1e-3;
    let there = |p| p * 2.0 + sato::geometry::Vec3::X * 10.0;
    assert!(near(moved.mesh.bounds().max, there(plain.mesh.bounds().max)));
    assert!(near(moved.camera.eye, there(plain.camera.eye)));
    assert_eq!(moved.lights.len(), plain.lights.len());
    assert!((moved.defaults.ao_radius / plain.defaults.ao_radius - 2.0).abs() < 1e-5);
}
