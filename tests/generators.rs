//! The procedural scenes keep their promises: counts, bits, clean geometry, usable views.

use glam::{DVec3, Vec3};
use sato::geometry::{Triangle, TriangleMesh};
use sato::scene::LightShape;
use sato::scene::generate::{GENERATORS, Generated, GeneratorEntry, MANY_TRIANGLES, find};
use std::collections::HashSet;
use std::path::Path;

/// Name, half the extent that holds every vertex, and the mesh's hash at seed 1, of all generators but
/// those of many triangles. A hash that changes on purpose is read off the failure's message.
const EXPECTED: &[(&str, f32, u64)] = &[
    ("mad-science", 6.0, 0x0cba_1c52_eb0a_0545),
    ("carnival", 90.0, 0x4997_2e10_6257_ebb5),
    ("bedroom", 6.1, 0x8cd9_6bfa_4491_b607),
    ("atrium", 20.0, 0x577a_e690_aaa4_eb5c),
    ("ship", 250.0, 0xd78d_b7bc_ecba_68db),
    ("shadow-overlap", 20.0, 0x2371_96b4_cba4_517d),
    ("equal-soup", 2.1, 0x33d3_aaa9_bd13_d2d9),
    ("crowd-1k", 107.0, 0xa2e8_3e7f_7d1f_3d6b),
    ("cloth", 9.1, 0xceb4_fef5_f564_8d3a),
    ("explosion", 60.1, 0x8422_654c_cef0_ba8f),
];

fn make(name: &str, seed: u64) -> Generated {
    (find(name).expect("a generator of that name").generate)(seed)
}

/// Those that are made here.
fn generators() -> impl Iterator<Item = &'static GeneratorEntry> {
    GENERATORS.iter().copied().filter(|entry| entry.triangles <= MANY_TRIANGLES)
}

/// FNV-1a over 32-bit words: every vertex's bits, then every index.
fn hash(mesh: &TriangleMesh) -> u64 {
    let vertices = mesh.vertices().iter().flat_map(|v| v.to_array().map(f32::to_bits));
    let indices = mesh.triangles().iter().flatten().copied();
    vertices
        .chain(indices)
        .fold(0xcbf2_9ce4_8422_2325, |h, word| (h ^ u64::from(word)).wrapping_mul(0x100_0000_01b3))
}

fn distance(p: DVec3, Triangle(corners): Triangle) -> f64 {
    let corners = corners.map(|c| c.as_dvec3());
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a).normalize();
    let inside = (0..3).all(|i| {
        let (from, to) = (corners[i], corners[(i + 1) % 3]);
        (to - from).cross(p - from).dot(normal) >= 0.0
    });
    if inside {
        return (p - a).dot(normal).abs();
    }
    let to_edge = |i: usize| {
        let (from, along) = (corners[i], corners[(i + 1) % 3] - corners[i]);
        let t = ((p - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        (p - from - along * t).length()
    };
    to_edge(0).min(to_edge(1)).min(to_edge(2))
}

#[test]
fn names_are_unique_hyphenated_and_have_a_scene_file() {
    let names: HashSet<&str> = GENERATORS.iter().map(|entry| entry.name).collect();
    assert_eq!(names.len(), GENERATORS.len());
    let made: HashSet<&str> = generators().map(|entry| entry.name).collect();
    assert_eq!(made, EXPECTED.iter().map(|e| e.0).collect());
    for entry in GENERATORS {
        let name = entry.name;
        let plain = |b: u8| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-';
        assert!(name.bytes().all(plain), "{name}");
        assert!(!entry.about.is_empty() && !entry.about.contains('\n'), "{name}");
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
        let text = std::fs::read_to_string(&file).expect("every generator has a scene file");
        let table: toml::Table = toml::from_str(&text).expect("valid TOML");
        assert_eq!(table["name"].as_str(), Some(name));
        assert_eq!(table["geometry"][0]["generator"].as_str(), Some(name));
    }
    assert!(find("no-such-scene").is_none());
}

#[test]
fn meshes_are_pinned_to_the_bit() {
    let mut wrong = Vec::new();
    for &(name, _, pinned) in EXPECTED {
        let (once, again) = (hash(&make(name, 1).mesh), hash(&make(name, 1).mesh));
        assert_eq!(once, again, "{name} differs between two runs");
        if once != pinned {
            wrong.push(format!("{name}: 0x{once:016x}"));
        }
    }
    assert!(wrong.is_empty(), "meshes have changed: {wrong:#?}");
}

#[test]
fn meshes_are_clean_and_of_the_promised_size() {
    for &(name, extent, _) in EXPECTED {
        let count = find(name).unwrap().triangles;
        for seed in [1, 7] {
            let mesh = make(name, seed).mesh;
            let off = mesh.len().abs_diff(count) as f64 / count as f64;
            assert!(off <= 0.02, "{name} has {} triangles", mesh.len());
            let inside = |p: &Vec3| p.is_finite() && p.abs().max_element() <= extent;
            assert!(mesh.vertices().iter().all(inside), "{name}: {:?}", mesh.bounds());
            let degenerate = (0..mesh.len()).filter(|&i| mesh.triangle(i).area() <= 0.0).count();
            assert_eq!(degenerate, 0, "{name}");
            let used: HashSet<u32> = mesh.triangles().iter().flatten().copied().collect();
            assert_eq!(used.len(), mesh.vertices().len(), "{name} has unused vertices");
        }
    }
}

#[test]
fn areas_spread_as_in_artists_models_but_for_the_control() {
    for entry in generators() {
        let mesh = (entry.generate)(1).mesh;
        let mut areas: Vec<f64> = (0..mesh.len()).map(|i| mesh.triangle(i).area()).collect();
        areas.sort_by(f64::total_cmp);
        let (least, median, most) = (areas[0], areas[areas.len() / 2], areas[areas.len() - 1]);
        if entry.name == "equal-soup" {
            assert!(most / least < 1.0 + 1e-4, "{least} to {most}");
        } else {
            assert!(most / median >= 1e4, "{}: {median} to {most}", entry.name);
        }
    }
}

#[test]
fn views_are_usable() {
    for entry in generators() {
        let Generated { mesh, camera, lights, ao_radius, .. } = (entry.generate)(1);
        let name = entry.name;
        let eye = camera.eye.as_dvec3();
        let nearest =
            (0..mesh.len()).map(|i| distance(eye, mesh.triangle(i))).fold(f64::INFINITY, f64::min);
        assert!(nearest > 0.2, "{name}: something is {nearest} m from the eye");
        assert!(camera.fov_degrees > 10.0 && camera.fov_degrees < 90.0, "{name}");
        let forward = (camera.look_at - camera.eye).normalize();
        assert!(forward.cross(camera.up).length() > 0.5, "{name}");
        assert!(ao_radius > 0.0 && ao_radius < mesh.bounds().diagonal(), "{name}");
        assert!(!lights.is_empty(), "{name}");
        let names: HashSet<&str> = lights.iter().map(|light| light.name.as_str()).collect();
        assert_eq!(names.len(), lights.len(), "{name}");
    }
}

#[test]
fn lights_are_valid_and_of_every_kind() {
    let mut kinds = HashSet::new();
    for entry in generators() {
        for light in (entry.generate)(1).lights {
            let name = (entry.name, light.name);
            assert!(light.strength.is_finite() && light.strength.min_element() > 0.0, "{name:?}");
            kinds.insert(match light.shape {
                LightShape::Quad { edge_u, edge_v, .. } => {
                    assert!(edge_u.cross(edge_v).length() > 0.0, "{name:?}");
                    "quad"
                }
                LightShape::Disk { normal, radius, .. } => {
                    assert!(radius > 0.0 && (normal.length() - 1.0).abs() < 1e-5, "{name:?}");
                    "disk"
                }
                LightShape::Sphere { radius, .. } => {
                    assert!(radius > 0.0, "{name:?}");
                    "sphere"
                }
                LightShape::Directional { direction, angular_diameter_degrees } => {
                    assert!((direction.length() - 1.0).abs() < 1e-5, "{name:?}");
                    assert!((0.0..180.0).contains(&angular_diameter_degrees), "{name:?}");
                    "directional"
                }
                LightShape::Point { .. } => "point",
            });
        }
    }
    assert_eq!(kinds.len(), 5, "{kinds:?}");
}
