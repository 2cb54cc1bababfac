//! Moving scenes, end to end.

mod common;

use assert_cmd::Command;
use common::files::{channels, table};
use predicates::prelude::*;
use predicates::str::contains;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A floor, and a blocker that goes along above it and turns.
const SCENE: &str = r#"
name = "table"
size = [32, 24]
[camera]
eye = [0.0, 2.5, 5.5]
look_at = [0.0, 0.8, 0.0]
fov_degrees = 50.0
[animation]
frames = 5
[[geometry]]
file = "floor.obj"
[[geometry]]
file = "blocker.obj"
[[geometry.key]]
time = 0
translate = [-1, 0.7, 0]
[[geometry.key]]
time = 1
rotate_degrees = [0, 90, 0]
translate = [1, 1.2, 0]
[[light]]
name = "lamp"
type = "quad"
corner = [-0.5, 2.5, -0.5]
edge_u = [1.0, 0.0, 0.0]
edge_v = [0.0, 0.0, 1.0]
radiance = 6.0
"#;

/// The same scene standing still.
fn still_scene() -> String {
    let (before, rest) = SCENE.split_once("[animation]").unwrap();
    let (geometry, lights) = rest.split_once("[[geometry.key]]").unwrap();
    let geometry = geometry.split_once("[[geometry]]").unwrap().1;
    let light = lights.split_once("[[light]]").unwrap().1;
    format!("{before}[[geometry]]{geometry}[[light]]{light}")
}

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("table.toml", SCENE);
    write("still.toml", &still_scene());
    write("floor.obj", "v -2 0 -2\nv 2 0 -2\nv 2 0 2\nv -2 0 2\nf 1 2 3\nf 1 3 4\n");
    write(
        "blocker.obj",
        "v -.5 0 -.3\nv .5 0 -.3\nv .5 0 .3\nv -.5 0 .3\nv 0 .5 0\nf 1 2 3\nf 1 3 4\nf 1 2 5\n",
    );
    folder
}

fn sato(folder: &Path) -> Command {
    let mut command = Command::cargo_bin("sato").unwrap();
    command.current_dir(folder).env_remove("SATO_SCENES").arg("animate");
    command
}

#[test]
fn the_command_follows_a_scene_file() {
    let folder = folder();
    let backends = ["--backend", "bvh8", "--backend", "bvh2:order=near"];
    sato(folder.path())
        .args(["table.toml", "-o", "out", "--frames", "1..4", "--spp", "2", "--size", "40", "30"])
        .args(backends)
        .args(["--require-agreement", "--json", "copy.json", "--rounds", "1"])
        .assert()
        .success()
        .stdout(contains("1 of 2 objects move").and(contains("agree on every ray")))
        .stderr("");
    let read = |file: &str| fs::read_to_string(folder.path().join(file)).unwrap();
    assert_eq!(read("copy.json"), read("out/animate.json"));
    let frames = table(&folder.path().join("out/frames.csv"));
    let numbers: Vec<&str> = frames.iter().map(|row| row["frame"].as_str()).collect();
    assert_eq!(numbers, ["1", "1", "2", "2", "3", "3"]);
    for frame in 1..4 {
        let png = format!("out/frames/frame_{frame:04}.png");
        let png = image::open(folder.path().join(png)).unwrap();
        assert_eq!((png.width(), png.height()), (40, 30));
    }
    assert!(!folder.path().join("out/frames/frame_0000.png").exists());
    let exr =
        |frame: usize| channels(&folder.path().join(format!("out/frames/frame_{frame:04}.exr")));
    assert_ne!(exr(1)["shadow.Y"], exr(2)["shadow.Y"]);
}

#[test]
fn the_command_is_silent_if_asked_and_takes_what_the_build_has() {
    let folder = folder();
    sato(folder.path())
        .args(["table.toml", "-o", "out", "--quiet", "--no-images", "--quality", "--rounds", "1"])
        .args(["--size", "16", "12"])
        .assert()
        .success()
        .stdout("")
        .stderr("");
    let frames = table(&folder.path().join("out/frames.csv"));
    assert_eq!(frames.len(), if cfg!(feature = "embree") { 6 * 5 } else { 2 * 5 });
    assert!(!folder.path().join("out/frames").exists());
}

#[test]
fn the_command_refuses_what_it_cannot_follow() {
    let folder = folder();
    fs::write(folder.path().join("file"), "a file").unwrap();
    let long = "18446744073709551616";
    for (arguments, status, part) in [
        (&["still.toml", "-o", "out"][..], 2, "does not move"),
        (&["table.toml"], 2, "--output"),
        (&["table.toml", "-o", "out", "--frames", "6"], 2, "has 5, from 0 to 4"),
        (&["table.toml", "-o", "out", "--frames", "3..2"], 2, "at least two"),
        (&["table.toml", "-o", "out", "--frames", "1"], 2, "at least two"),
        (&["table.toml", "-o", "out", "--frames", "x"], 2, "A..B"),
        (&["table.toml", "-o", "out", "--frames", long], 2, "no number"),
        (&["table.toml", "-o", "out", "--rounds", "0"], 2, "rounds"),
        (&["table.toml", "-o", "out", "--rays", "sideways"], 2, "ao-unbounded"),
        (&["table.toml", "-o", "out", "--size", "0", "4"], 2, "size"),
        (&["table.toml", "-o", "out", "--backend", "bvh2:update=sideways"], 2, "sideways"),
        (&["absent.toml", "-o", "out"], 1, "absent.toml"),
        (&["table.toml", "-o", "file/out", "--backend", "bvh2"], 1, "file/out"),
    ] {
        let assert = sato(folder.path()).args(arguments).assert().code(status).stdout("");
        let text = String::from_utf8_lossy(&assert.get_output().stderr).into_owned();
        assert!(text.contains(part), "{arguments:?}: {text}");
        assert!(!text.contains("panicked"), "{text}");
    }
    assert!(!folder.path().join("out").exists());
    sato(folder.path()).arg("--help").assert().success().stdout(contains("--quality"));
}
