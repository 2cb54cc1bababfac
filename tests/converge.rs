//! Error against samples and time, end to end.

use assert_cmd::Command;
use predicates::prelude::*;
use predicates::str::contains;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A floor, a blocker above it, and a light above that.
const SCENE: &str = r#"
name = "table"
[camera]
eye = [0.0, 2.5, 5.5]
look_at = [0.0, 0.8, 0.0]
fov_degrees = 50.0
[ambient_occlusion]
radius = 1.5
[[geometry]]
file = "table.obj"
[[light]]
name = "lamp"
type = "quad"
corner = [-0.5, 2.5, -0.5]
edge_u = [1.0, 0.0, 0.0]
edge_v = [0.0, 0.0, 1.0]
radiance = 6.0
"#;

const MESH: &str = "\
v -2 0 -2\nv 2 0 -2\nv 2 0 2\nv -2 0 2\nv -2 2 -2\nv 2 2 -2
v -0.5 0.7 -0.5\nv 0.5 0.7 -0.5\nv 0.5 0.7 0.5\nv -0.5 0.7 0.5
f 1 2 3\nf 1 3 4\nf 1 5 6\nf 1 6 2\nf 7 8 9\nf 7 9 10\n";

const INDEPENDENT: &str = "bvh2 sampler=independent light-sampling=area skip=none";
const SOBOL: &str = "bvh2 sampler=sobol light-sampling=solid-angle skip=none";

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("table.toml"), SCENE).unwrap();
    fs::write(folder.path().join("table.obj"), MESH).unwrap();
    folder
}

fn sato(folder: &Path) -> Command {
    let mut command = Command::cargo_bin("sato").unwrap();
    command.current_dir(folder).env_remove("SATO_SCENES").arg("converge");
    command
}

/// Runs on the table, and returns the report.
fn converge(folder: &Path, more: &[&str]) -> Value {
    let size = ["--size", "32", "24", "--quiet", "-o", "out"];
    sato(folder).arg("table.toml").args(size).args(more).assert().success().stdout("");
    let text = fs::read_to_string(folder.join("out/report.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

fn list<'a>(value: &'a Value, key: &str) -> &'a Vec<Value> {
    value[key].as_array().unwrap_or_else(|| panic!("{key}: {value}"))
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key}: {value}"))
}

#[test]
fn errors_fall_as_theory_says_and_better_samples_fall_faster() {
    let folder = folder();
    let renderers = ["--renderer", INDEPENDENT, "--renderer", SOBOL, "--renderer", "native"];
    let passes = ["--passes", "ao,shadow", "--spp", "32", "--seeds", "6"];
    let report = converge(folder.path(), &[&renderers[..], &passes].concat());
    assert_eq!(report["schema_version"], 1);
    let cells = list(&report, "cells");
    assert_eq!(cells.len(), 2);
    for cell in cells {
        let slopes = list(cell, "slopes");
        let slope = |index: usize| number(&slopes[index]["slope"], "value");
        assert!((slope(0) + 0.5).abs() < 0.04, "{cell}");
        assert!(slope(1) < -0.62 && slope(2) == slope(1), "{cell}");
        let reference = &cell["reference"];
        assert_eq!(reference["origin"], "rendered");
        assert!((0.001..0.1).contains(&number(reference, "part_of_smallest_error")), "{cell}");
    }
    // 1, 2, 4, 8, 16, 32 samples of three renderers and two passes.
    let points = list(&report, "points");
    assert_eq!(points.len(), 6 * 3 * 2);
    for point in points {
        let [rmse, low, high] = ["rmse", "rmse_low", "rmse_high"].map(|key| number(point, key));
        assert!(0.0 < low && low <= rmse && rmse <= high && high < 2.0 * low, "{point}");
        let variance = number(point, "variance");
        // The mean squared error of what is unbiased is its variance, but for chance.
        assert!((rmse * rmse / variance - 1.0).abs() < 0.25, "{point}");
        assert!(number(point, "squared_bias").abs() < 0.1 * variance, "{point}");
        let efficiency = 1e3 / (variance * number(point, "total_ms"));
        assert!((number(point, "efficiency_per_s") / efficiency - 1.0).abs() < 1e-9, "{point}");
        assert!((0.0..=1.0).contains(&number(point, "flip")), "{point}");
        assert!(number(point, "relative_mse") > 0.0 && number(point, "rays") > 0.0, "{point}");
        // The third takes the samples of the second: the same pictures.
        let twin = point["renderer"] == "native";
        assert_eq!(point["differing_pixels"], if twin { 0.into() } else { Value::Null });
    }
    // By kind as altogether.
    let of_all = |rows: &[Value], key: &str| -> f64 {
        let own = rows.iter().filter(|r| r["renderer"] == "native" && r["samples"] == 32);
        own.map(|row| number(row, key)).sum()
    };
    let skipped = list(&report, "skipped");
    let left_out: f64 = skipped
        .iter()
        .filter(|row| row["is_traced"] == false)
        .map(|row| row["rays"].as_f64().unwrap())
        .sum();
    assert_eq!(left_out, of_all(points, "rays_skipped"));
    assert!(skipped.iter().all(|row| row["renderer"] == "native"), "{skipped:?}");
    assert!(of_all(skipped, "rays") > 0.0);
    let at_end = list(&report, "at_end");
    assert_eq!(at_end.len(), 3 * 2);
    for row in at_end.iter().filter(|r| r["renderer"] == "native" && r["against"] == INDEPENDENT) {
        assert!(number(row, "equal_time") > 2.0, "{row}");
        assert!(number(row, "equal_error_low") <= number(row, "equal_error_high"), "{row}");
    }
    let means = list(&report, "means");
    assert_eq!(means.len(), 3);
    assert!(means.iter().all(|m| m["equal_error"]["count"] == 2), "{means:?}");
    // Everything that is named is there; figures are in the CSV file, too.
    let files = list(&report, "files");
    assert!(files.len() >= 4 + 2 * 5, "{files:?}");
    for file in files {
        assert!(folder.path().join("out").join(file.as_str().unwrap()).exists(), "{file}");
    }
    let csv = fs::read_to_string(folder.path().join("out/points.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + points.len());
    let text = fs::read_to_string(folder.path().join("out/report.txt")).unwrap();
    assert!(text.contains("table, shadow") && text.contains("geometric means over 2"), "{text}");
}

#[test]
fn references_are_kept_and_damaged_ones_are_not_believed() {
    let folder = folder();
    let run = |more: &[&str]| {
        let few = ["--passes", "shadow", "--spp", "4", "--seeds", "2", "--reference-factor", "16"];
        let report = converge(folder.path(), &[&few[..], &["--renderer", "bvh8"], more].concat());
        let errors: Vec<f64> = list(&report, "points").iter().map(|p| number(p, "rmse")).collect();
        (report["cells"][0]["reference"]["origin"].clone(), errors)
    };
    let kept = || -> Vec<PathBuf> {
        let files = fs::read_dir(folder.path().join("out/references")).unwrap();
        files.map(|f| f.unwrap().path()).collect()
    };
    let (origin, errors) = run(&[]);
    assert_eq!(origin, "rendered");
    assert_eq!(run(&[]), ("kept".into(), errors.clone()));
    assert_eq!(kept().len(), 1);
    // Other seeds are held against the same reference.
    let (origin, others) = run(&["--seed", "5"]);
    assert!(origin == "kept" && others != errors, "{origin}");
    for damage in [
        |bytes: &mut Vec<u8>| bytes[700] ^= 1,
        |bytes: &mut Vec<u8>| bytes.truncate(500),
        |bytes: &mut Vec<u8>| bytes.clear(),
    ] {
        let mut bytes = fs::read(&kept()[0]).unwrap();
        damage(&mut bytes);
        fs::write(&kept()[0], bytes).unwrap();
        let (origin, again) = run(&[]);
        assert!(origin["replaced"].is_string() && again == errors, "{origin}");
        assert_eq!(run(&[]).0, "kept");
    }
    // What changes the picture has another reference.
    for [spp, width, radius] in [["4", "30", "1.5"], ["4", "30", "2.5"], ["16", "30", "2.5"]] {
        let files = kept().len();
        sato(folder.path())
            .args(["table.toml", "-o", "out", "--quiet", "--seeds", "1", "--renderer", "bvh8"])
            .args(["--passes", "ao", "--spp", spp, "--size", width, "24", "--ao-radius", radius])
            .args(["--reference-factor", "4"])
            .assert()
            .success();
        assert_eq!(kept().len(), files + 1, "{spp} {width} {radius}");
    }
    fs::write(folder.path().join("table.toml"), SCENE.replace("6.0", "5.0")).unwrap();
    assert_eq!(run(&[]).0, "rendered");
}

#[test]
fn one_renderer_and_one_seed_will_do() {
    let folder = folder();
    sato(folder.path())
        .args(["table.toml", "--renderer", "bvh8", "--spp", "3", "--seeds", "1", "--passes", "ao"])
        .args(["--size", "9", "7", "--json", "x.json"])
        .assert()
        .success()
        .stdout(contains("table, ao").and(contains("bvh8:")).and(contains("equal error").not()));
    let text = fs::read_to_string(folder.path().join("x.json")).unwrap();
    let report: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(list(&report, "points").len(), 3);
    assert_eq!(report["points"][0]["variance"], Value::Null);
    assert!(report["means"].as_array().unwrap().is_empty());
}

/// The shadow of a point light has no error, and that is no reason to stop.
#[test]
fn what_has_no_error_has_no_ratio() {
    let folder = folder();
    let point = "type = \"point\"\nposition = [0.0, 2.5, 0.0]\nintensity = 5.0\n";
    let scene = SCENE.split("type = ").next().unwrap().to_string() + point;
    fs::write(folder.path().join("table.toml"), scene).unwrap();
    let renderers = ["--renderer", "bvh2", "--renderer", INDEPENDENT];
    let report =
        converge(folder.path(), &[&renderers[..], &["--spp", "4", "--seeds", "2"]].concat());
    let of = |pass: &str, rows: &str| -> Vec<Value> {
        list(&report, rows).iter().filter(|row| row["pass"] == pass).cloned().collect()
    };
    assert!(of("shadow", "points").iter().all(|point| point["rmse"] == 0.0));
    assert!(of("shadow", "at_end").iter().all(|row| row["equal_error"] == Value::Null));
    assert!(of("ao", "at_end").iter().all(|row| row["equal_error"].is_number()));
    assert_eq!(report["means"][0]["equal_error"]["count"], 1);
}

#[test]
fn nonsense_is_refused_in_one_line() {
    let folder = folder();
    let dark = format!("light = []\n{}", SCENE.split("[[light]]").next().unwrap());
    fs::write(folder.path().join("dark.toml"), dark).unwrap();
    let away = SCENE.replace("look_at = [0.0, 0.8, 0.0]", "look_at = [0.0, 9.0, 9.0]");
    fs::write(folder.path().join("away.toml"), away).unwrap();
    let one_line = |text: &str| text.trim_end().lines().count() == 1;
    for (arguments, part) in [
        (&["table.toml", "--renderer", "bvh8", "--renderer", "bvh8"][..], "given twice"),
        (&["table.toml", "table.toml", "--renderer", "bvh8"], "twice"),
        (&["dark.toml", "--passes", "shadow"], "no light"),
        (&["away.toml", "--spp", "1", "--seeds", "1", "--renderer", "bvh8"], "no camera ray"),
        (&["table.toml", "--size", "0", "5"], "no pixels"),
        (&["table.toml", "--ao-radius", "0"], "radius"),
    ] {
        sato(folder.path())
            .args(arguments)
            .assert()
            .code(2)
            .stderr(contains(part).and(predicate::function(one_line)));
    }
    for (option, value) in [
        ("--renderer", "bvh8 sampler=halton"),
        ("--renderer", "bvh9"),
        ("--spp", "0"),
        ("--seeds", "0"),
        ("--reference-factor", "0"),
        ("--passes", "light"),
    ] {
        sato(folder.path()).args(["table.toml", option, value]).assert().code(2);
    }
    sato(folder.path()).assert().code(2);
    // Nothing is left behind.
    assert!(!folder.path().join("out/converge/report.json").exists());
}
