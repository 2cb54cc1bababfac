//! The program end to end: what it writes, what it prints, how it exits.

use assert_cmd::Command;
use predicates::prelude::*;
use predicates::str::{contains, is_empty};
use serde_json::Value;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A box open at the top, a small blocker above its floor, a light above that.
const SCENE: &str = r#"
name = "box"
size = [40, 30]
[camera]
eye = [0.0, 2.5, 5.5]
look_at = [0.0, 0.8, 0.0]
fov_degrees = 50.0
[ambient_occlusion]
radius = 1.5
[[geometry]]
file = "box.obj"
[[light]]
name = "lamp"
type = "quad"
corner = [-0.5, 3.5, -0.5]
edge_u = [1.0, 0.0, 0.0]
edge_v = [0.0, 0.0, 1.0]
radiance = 6.0
[[light]]
name = "sun"
type = "directional"
direction = [0.3, -1.0, -0.2]
angular_diameter_degrees = 2.0
"#;

const MESH: &str = "\
v -2 0 -2\nv 2 0 -2\nv 2 0 2\nv -2 0 2\nv -2 2 -2\nv 2 2 -2
v -0.5 0.7 -0.5\nv 0.5 0.7 -0.5\nv 0.5 0.7 0.5\nv -0.5 0.7 0.5
f 1 2 3\nf 1 3 4\nf 1 5 6\nf 1 6 2\nf 7 8 9\nf 7 9 10\n";

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("box.toml"), SCENE).unwrap();
    fs::write(folder.path().join("box.obj"), MESH).unwrap();
    folder
}

fn sato(folder: &Path) -> Command {
    let mut command = Command::cargo_bin("sato").unwrap();
    command.current_dir(folder).env_remove("SATO_SCENES");
    command
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn help_and_list_name_everything() {
    let folder = folder();
    sato(folder.path()).arg("--help").assert().success().stdout(contains("compare"));
    let list = sato(folder.path()).arg("list").assert().success();
    let text = String::from_utf8(list.get_output().stdout.clone()).unwrap();
    let names = sato::backend::catalogue::BACKENDS
        .iter()
        .map(|b| b.name)
        .chain(sato::order::ORDERS.iter().map(|o| o.name))
        .chain(sato::build::BUILDERS.iter().map(|b| b.name))
        .chain(sato::converge::PRESETS.iter().map(|p| p.name))
        .chain(sato::scene::generate::GENERATORS.iter().map(|g| g.name));
    for name in names {
        assert!(text.contains(name), "{name}");
    }
}

#[test]
fn render_writes_exr_and_png_and_a_report() {
    let folder = folder();
    sato(folder.path())
        .args(["render", "box.toml", "-o", "new/picture.exr", "--spp", "4", "--stats"])
        .args(["--heat-map", "--json", "render.json"])
        .assert()
        .success()
        .stdout(contains("picture.exr").and(contains("nodes")))
        .stderr(is_empty());
    let picture = folder.path().join("new/picture.exr");
    let image = exr::prelude::read_all_flat_layers_from_file(&picture).unwrap();
    let names: Vec<String> =
        image.layer_data[0].channel_data.list.iter().map(|c| c.name.to_string()).collect();
    for channel in ["R", "G", "B", "A", "ao.Y", "shadow.lamp.Y", "shadow.sun.Y", "shadow.Y"] {
        assert!(names.iter().any(|n| n == channel), "{channel} in {names:?}");
    }
    for channel in ["depth.Z", "normal.X", "nodes.Y"] {
        assert!(names.iter().any(|n| n == channel), "{channel} in {names:?}");
    }
    for png in ["new/picture.png", "new/picture.nodes.png"] {
        let png = image::open(folder.path().join(png)).unwrap();
        assert_eq!((png.width(), png.height()), (40, 30));
    }
    let report = json(&folder.path().join("render.json"));
    assert_eq!(report["schema_version"], 1);
    assert_eq!(report["scene"]["triangles"], 6);
    assert_eq!(report["size"], serde_json::json!([40, 30]));
}

#[test]
fn render_makes_the_layers_asked_for_and_adapts() {
    let folder = folder();
    let render = |arguments: &[&str]| {
        sato(folder.path())
            .args(["render", "box.toml", "-o", "x.exr", "--stats", "--json", "x.json"])
            .args(arguments)
            .assert()
            .success()
            .stderr(is_empty())
    };
    let names = || {
        let file = folder.path().join("x.exr");
        let image = exr::prelude::read_all_flat_layers_from_file(file).unwrap();
        let channels = image.layer_data[0].channel_data.list.iter();
        channels.map(|c| c.name.to_string()).collect::<Vec<_>>()
    };
    render(&["--layers", "depth,shadow.lamp"]).stdout(
        contains("layers left out: picture, shadow, ao,")
            .and(contains("MB not written"))
            .and(contains("not traced, as no layer needs it: ao, shadow.sun"))
            .and(contains("x.png").not()),
    );
    assert_eq!(names(), ["depth.Z", "shadow.lamp.Y"]);
    assert!(!folder.path().join("x.png").exists(), "no PNG without a picture");
    render(&["--adaptive", "64"]).stdout(contains("adaptive: ").and(contains("pilot: ")));
    assert!(
        names().contains(&"samples.ao.Y".into())
            && names().contains(&"samples.shadow.lamp.Y".into())
    );
    let report = json(&folder.path().join("x.json"));
    assert_eq!(report["adaptive"], 64);
    let of_class = &report["render"]["classes"][0]["adaptive"];
    assert!(of_class["samples_mean"].as_f64().unwrap() <= 16.0, "{of_class}");
}

#[test]
fn pictures_do_not_depend_on_threads_or_native_backend() {
    let folder = folder();
    let render = |threads: &str, backend: &str| {
        sato(folder.path())
            .args(["render", "box.toml", "-o", "x.exr", "--spp", "8", "--quiet"])
            .args(["--threads", threads, "--backend", backend])
            .assert()
            .success()
            .stdout(is_empty())
            .stderr(is_empty());
        let image =
            exr::prelude::read_all_flat_layers_from_file(folder.path().join("x.exr")).unwrap();
        let channels = image.layer_data[0].channel_data.list.clone();
        let bits = channels.iter().flat_map(|c| c.sample_data.values_as_f32().map(f32::to_bits));
        bits.collect::<Vec<_>>()
    };
    let expected = render("1", "brute");
    assert!(expected.iter().any(|b| *b != expected[0]));
    let backends = [
        "bvh2",
        "bvh2:order=near",
        "bvh2:order=far",
        "bvh2:order=random",
        "bvh2:order=trained",
        "bvh2:trace=packet",
        "kd",
    ];
    for backend in backends {
        assert_eq!(render("1", backend), expected, "{backend}");
        assert_eq!(render("0", backend), expected, "{backend}, all threads");
    }
}

/// The fields of the JSON report, with their kinds: a change here is a change of the schema.
fn check_compare_schema(report: &Value, backends: usize) {
    assert_eq!(report["schema_version"], sato::report::SCHEMA_VERSION);
    for text in ["sato_version", "cpu", "platform"] {
        assert!(report[text].is_string(), "{text}");
    }
    for number in ["threads", "seed", "rounds"] {
        assert!(report[number].is_u64(), "{number}");
    }
    assert!(report["command"].as_array().unwrap().iter().all(Value::is_string));
    for number in ["triangles", "vertices", "mesh_memory_bytes"] {
        assert!(report["scene"][number].is_u64(), "{number}");
    }
    assert_eq!(report["backends"].as_array().unwrap().len(), backends);
    for backend in report["backends"].as_array().unwrap() {
        assert!(backend["spec"].is_string() && backend["full_spec"].is_string());
        assert!(backend["build_ms"].is_f64() && backend["order_ms"].is_f64());
        assert!(backend["memory_bytes"].is_u64() && backend["notes"].is_array());
    }
    for class in report["classes"].as_array().unwrap() {
        assert!(class["class"].is_string() && class["rays"].is_u64());
        assert!(class["rays_skipped"].is_u64());
        let share = class["occluded_share"].as_f64().unwrap();
        assert!((0.0..=1.0).contains(&share));
        assert_eq!(class["results"].as_array().unwrap().len(), backends);
        for result in class["results"].as_array().unwrap() {
            for summary in ["trace_ms", "ratio_to_first"] {
                let [min, median, max] =
                    ["min", "median", "max"].map(|k| result[summary][k].as_f64().unwrap());
                assert!(0.0 < min && min <= median && median <= max, "{summary}");
            }
            assert!(result["mrays_per_s"].as_f64().unwrap() > 0.0);
            assert!(result["occluded"].is_u64());
        }
        let pairs = backends * (backends - 1) / 2;
        assert_eq!(class["agreement"].as_array().unwrap().len(), pairs);
        for pair in class["agreement"].as_array().unwrap() {
            assert_eq!(pair["backends"].as_array().unwrap().len(), 2);
            assert!(pair["differing_rays"].is_u64());
            assert!(pair["differing_per_million"].is_f64());
        }
        let judgement = &class["judgement"];
        assert!(judgement["disputed_rays"].is_u64() && judgement["sampled_rays"].is_u64());
        assert_eq!(judgement["backends"].as_array().unwrap().len(), backends);
        for wrong in judgement["backends"].as_array().unwrap() {
            assert!(wrong["wrong_per_million"].is_f64() && wrong["reasons"].is_array());
            assert!(wrong["false_hits"].is_u64() && wrong["missed_hits"].is_u64());
        }
    }
}

#[test]
fn compare_leaves_images_a_report_and_rays() {
    let folder = folder();
    sato(folder.path())
        .args(["compare", "box.toml", "-o", "out", "--spp", "4", "--rounds", "3"])
        .args(["--backend", "bvh2:order=near", "--backend", "bvh2", "--backend", "brute"])
        .args(["--require-agreement", "--seed", "7"])
        .assert()
        .success()
        .stdout(contains("ao-unbounded").and(contains("agree on every ray")))
        .stdout(contains("report.json"));
    let out = folder.path().join("out");
    let report = json(&out.join("report.json"));
    check_compare_schema(&report, 3);
    assert_eq!(report["seed"], 7);
    for class in report["classes"].as_array().unwrap() {
        let judged = class["judgement"]["sampled_rays"].as_u64().unwrap();
        assert_eq!(judged, class["rays"].as_u64().unwrap().min(2000));
        assert_eq!(class["judgement"]["disputed_rays"], 0);
        assert_eq!(class["judgement"]["wrong_in_sample"]["missed_hits"], 0);
    }
    let classes = report["classes"].as_array().unwrap();
    let names: Vec<_> = classes.iter().map(|c| c["class"].as_str().unwrap()).collect();
    assert_eq!(names, ["ao", "ao-unbounded", "shadow"]);
    let nodes = &classes[0]["results"][0]["nodes_per_ray"];
    assert!(nodes.as_f64().unwrap() >= 1.0);
    for file in report["files"].as_array().unwrap() {
        assert!(out.join(file.as_str().unwrap()).is_file(), "{file}");
    }
    let pixels = |name: &str| image::open(out.join(name)).unwrap().into_rgb8().into_raw();
    assert_eq!(pixels("1-bvh2-order-near.png"), pixels("3-brute.png"));
    // Nothing half written lies about.
    let stray = fs::read_dir(&out)
        .unwrap()
        .filter(|e| e.as_ref().unwrap().file_name().to_string_lossy().starts_with('.'));
    assert_eq!(stray.count(), 0);
}

#[test]
fn rays_are_recorded_and_replayed() {
    let folder = folder();
    sato(folder.path())
        .args(["rays", "record", "box.toml", "-o", "x.rays", "--rays", "ao,shadow", "--spp", "2"])
        .assert()
        .success()
        .stdout(contains("x.rays"));
    sato(folder.path())
        .args(["rays", "replay", "x.rays", "--backend", "brute", "--backend", "bvh2"])
        .args(["--rounds", "1", "--json", "replay.json"])
        .assert()
        .success()
        .stdout(contains("agree on every ray"));
    check_compare_schema(&json(&folder.path().join("replay.json")), 2);
    fs::write(folder.path().join("cut.rays"), "sato rays 1\n{}").unwrap();
    sato(folder.path())
        .args(["rays", "replay", "cut.rays", "--backend", "bvh2"])
        .assert()
        .code(1)
        .stderr(contains("cut.rays"));
}

#[test]
fn scenes_are_described_and_exported() {
    let folder = folder();
    sato(folder.path())
        .args(["scene", "info", "box.toml", "--json", "info.json"])
        .assert()
        .success()
        .stdout(contains("triangles"));
    assert_eq!(json(&folder.path().join("info.json"))["triangles"], 6);
    sato(folder.path()).args(["scene", "export", "box.toml", "-o", "copy.obj"]).assert().success();
    sato(folder.path())
        .args(["scene", "info", "copy.obj"])
        .assert()
        .success()
        .stdout(contains("6"));
}

#[test]
fn usage_errors_exit_with_2_and_name_the_choices() {
    let folder = folder();
    let cases: &[(&[&str], &str)] = &[
        (&["render", "box.toml", "--backend", "bvh9"], "one of: brute"),
        (&["render", "box.toml", "--backend", "bvh2:order=up"], "node-sato"),
        (&["render", "box.toml", "--size", "0", "10"], "0 x 10"),
        (&["render", "box.toml", "--spp", "0"], "samples"),
        (&["render", "box.toml", "--ao-radius", "nan"], "radius"),
        (&["render", "box.toml", "--passes", "aoo"], "ao-unbounded"),
        (&["render", "box.toml", "--threads", "999999"], "--threads"),
        (&["render", "box.toml", "--layers", "depth,depht"], "choose from picture, shadow"),
        (&["render", "box.toml", "--layers", ""], "no layer \"\""),
        (&["render", "box.toml", "--adaptive", "8"], "16, the mean"),
        (&["render", "box.toml", "--adaptive", "64", "--spp", "6"], "multiple of 4"),
        (&["render", "box.toml", "--adaptive", "64", "--camera-samples", "4"], "camera sample"),
        (&["render", "box.toml", "-o", "x.jpg"], ".exr"),
        (&["compare", "box.toml"], "--backend"),
        (&["compare", "box.toml", "--backend", "bvh2", "--rounds", "0"], "--rounds"),
        (&["compare", "box.toml", "--backend", "bvh2", "--require-agreement", "-1"], "-1"),
        (&["nonsense"], "nonsense"),
    ];
    for (arguments, expected) in cases {
        sato(folder.path()).args(*arguments).assert().code(2).stderr(contains(*expected));
    }
    let files = fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(files, 2, "usage errors write nothing");
}

#[test]
fn errors_exit_with_1_in_one_line() {
    let folder = folder();
    fs::write(folder.path().join("bad.toml"), "[camera]\neye = 3\n").unwrap();
    for (scene, expected) in [("none.toml", "none.toml"), ("bad.toml", "bad.toml:2")] {
        let assert = sato(folder.path()).args(["render", scene]).assert().code(1);
        let stderr = String::from_utf8(assert.get_output().stderr.clone()).unwrap();
        assert!(stderr.contains(expected), "{stderr}");
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
    }
    sato(folder.path())
        .args(["render", "box.toml", "-o", "box.obj/x.exr"])
        .assert()
        .code(1)
        .stderr(contains("box.obj"));
}

#[cfg(not(feature = "embree"))]
#[test]
fn without_embree_the_error_says_how_to_get_it() {
    let folder = folder();
    sato(folder.path())
        .args(["render", "box.toml", "--backend", "embree"])
        .assert()
        .code(1)
        .stderr(contains("make setup"));
}

#[cfg(feature = "embree")]
#[test]
fn embree_is_compared_like_the_others() {
    let folder = folder();
    sato(folder.path())
        .args(["compare", "box.toml", "-o", "out", "--spp", "4", "--rounds", "2"])
        .args([
            "--backend",
            "bvh2",
            "--backend",
            "embree:mode=robust",
            "--backend",
            "embree:width=8",
        ])
        .args(["--require-agreement", "1000"])
        .assert()
        .success();
    check_compare_schema(&json(&folder.path().join("out/report.json")), 3);
}

/// Two backends of different numerics must be told apart: a mesh whose edges rays graze.
#[cfg(feature = "embree")]
#[test]
fn disagreement_exits_with_3_and_can_be_replayed() {
    let folder = folder();
    // The camera looks straight at shared edges from a grid of integers.
    let mut mesh = String::new();
    for y in 0..=40 {
        for x in 0..=40 {
            mesh += &format!(
                "v {} {} {}\n",
                x as f32 / 3.0,
                y as f32 / 3.0,
                ((x * y) % 7) as f32 / 9.0
            );
        }
    }
    for y in 0..40 {
        for x in 0..40 {
            let a = y * 41 + x + 1;
            mesh += &format!("f {} {} {}\nf {} {} {}\n", a, a + 1, a + 42, a, a + 42, a + 41);
        }
    }
    fs::write(folder.path().join("grid.obj"), mesh).unwrap();
    let output = sato(folder.path())
        .args(["compare", "grid.obj", "-o", "out", "--size", "200", "150", "--rounds", "1"])
        .args(["--backend", "bvh2", "--backend", "embree", "--require-agreement"])
        .output()
        .unwrap();
    let report = json(&folder.path().join("out/report.json"));
    let differing: u64 = report["classes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|c| c["agreement"][0]["differing_rays"].as_u64().unwrap())
        .sum();
    assert_eq!(output.status.code(), Some(if differing > 0 { 3 } else { 0 }), "{differing}");
    if differing > 0 {
        sato(folder.path())
            .args(["rays", "replay", "out/differing.rays", "--rounds", "1"])
            .args(["--backend", "bvh2", "--backend", "embree"])
            .assert()
            .success()
            .stdout(contains("is occluded for"));
    }
}
