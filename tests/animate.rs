//! Moving scenes frame by frame.

mod common;

use common::built;
use common::files::{channels, table};
use common::moving::moving_scene;
use common::random::Random;
use sato::animate::{AnimateReport, Plan, animate_text, run};
use sato::geometry::Vec3;
use sato::render::{Pass, RenderOptions, RenderSettings, render};
use sato::scene::{Camera, Light, LightShape, Scene};
use std::cell::Cell;
use std::fs;
use std::path::Path;
use std::sync::Arc;

const FRAMES: usize = 4;

fn scene(seed: u64) -> Scene {
    let mut scene = moving_scene(&mut Random::new(seed), FRAMES);
    scene.camera = Camera {
        eye: Vec3::new(0.0, 2.0, 12.0),
        look_at: Vec3::ZERO,
        up: Vec3::Y,
        fov_degrees: 50.0,
    };
    let shape = LightShape::Quad {
        corner: Vec3::new(-2.0, 9.0, -2.0),
        edge_u: Vec3::X * 4.0,
        edge_v: Vec3::Z * 4.0,
    };
    scene.lights = vec![Light { name: "lamp".into(), shape, strength: Vec3::splat(20.0) }];
    scene
}

fn plan(scene: &Scene, folder: &Path, backends: &[&str]) -> Plan {
    Plan {
        backends: backends.iter().map(|spec| spec.parse().unwrap()).collect(),
        frames: 0..FRAMES,
        render: RenderSettings {
            size: [48, 32],
            spp: 4,
            passes: vec![Pass::Shadow],
            ..RenderSettings::of_scene(scene)
        },
        rounds: 2,
        quality: false,
        pictures: Some(vec![("test:fact".into(), "known".into())]),
        folder: folder.to_path_buf(),
    }
}

#[test]
fn every_frame_is_the_picture_that_a_new_tree_makes() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene(81);
    // Camera rays must not build what shadow rays are to pay for: a tree of their own answers them.
    let plan = plan(&scene, folder.path(), &["lazy", "bvh2", "brute"]);
    let steps = Cell::new((0, 0));
    let report = run(&scene, &plan, &|done, total| {
        assert!(done > steps.get().0 && done <= total);
        steps.set((done, total));
    })
    .unwrap();
    assert_eq!(steps.get().0, steps.get().1);
    assert_eq!(report.rows.len(), 3 * FRAMES);
    let motion = scene.motion.as_ref().unwrap();
    let mut pictures = Vec::new();
    for frame in 0..FRAMES {
        let mesh = Arc::new(motion.mesh_at(&scene.mesh, frame));
        let still = Scene { mesh, motion: None, ..scene.clone() };
        let tracer = built(&"brute".parse().unwrap(), &still);
        let film = render(&still, &*tracer, &plan.render, &RenderOptions::default()).unwrap().film;
        let read = channels(&folder.path().join(format!("frames/frame_{frame:04}.exr")));
        assert!(read.len() >= 6, "{:?}", read.keys());
        for (name, values) in &read {
            let (layer, channel) = name.rsplit_once('.').unwrap_or(("", name));
            let wanted = film.channel(layer, channel).unwrap_or_else(|| panic!("no {name}"));
            let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(values), bits(wanted), "frame {frame}, {name}");
        }
        let png = fs::read(folder.path().join(format!("frames/frame_{frame:04}.png"))).unwrap();
        assert!(!pictures.contains(&png), "frame {frame} is an earlier one");
        pictures.push(png);
    }
    for row in &report.rows {
        assert_eq!(row.differing_rays, 0, "{row:?}");
        assert!(row.rays > 500 && row.occluded_share > 0.02, "{row:?}");
        assert!(row.trace_ms_min <= row.trace_ms && row.trace_ms <= row.trace_ms_max, "{row:?}");
        assert_eq!(row.frame_ms, row.update_ms + row.first_trace_ms);
        assert!(row.memory_bytes.is_none() && row.sah_cost.is_none(), "nobody asked: {row:?}");
        let first = report.rows.iter().find(|other| other.frame == row.frame).unwrap();
        assert_eq!((row.rays, row.occluded_share), (first.rays, first.occluded_share));
    }
}

#[test]
fn tables_and_record_say_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene(82);
    let mut plan = plan(&scene, folder.path(), &["bvh8", "bvh2:order=near,update=rebuild"]);
    (plan.frames, plan.quality, plan.pictures) = (1..4, true, None);
    let report = run(&scene, &plan, &|_, _| {}).unwrap();
    let frames = table(&folder.path().join("frames.csv"));
    assert_eq!(frames.len(), 2 * 3);
    for (text, row) in frames.iter().zip(&report.rows) {
        let number =
            |key: &str| text[key].parse::<f64>().unwrap_or_else(|_| panic!("{key}: {text:?}"));
        assert_eq!((number("frame"), &text["backend"]), (row.frame as f64, &row.backend));
        assert_eq!((number("update_ms"), number("trace_ms")), (row.update_ms, row.trace_ms));
        assert!(number("memory_bytes") > 0.0, "{text:?}");
        // What the backend does not know is empty.
        assert_eq!(text["relative_sah_cost"].is_empty(), row.relative_sah_cost.is_none());
        if row.backend == "bvh2:order=near,update=rebuild" {
            assert_eq!(number("relative_sah_cost"), 1.0, "built anew: {text:?}");
        }
    }
    let totals = table(&folder.path().join("totals.csv"));
    for (text, total) in totals.iter().zip(&report.totals) {
        let later = report.rows.iter().filter(|r| r.backend == total.backend && r.frame > 1);
        let (frames, sum) = later.fold((0, 0.0), |(n, sum), row| (n + 1, sum + row.frame_ms));
        assert_eq!(frames, total.frames);
        assert!((text["frame_ms"].parse::<f64>().unwrap() - sum).abs() < 1e-9 * sum);
    }
    assert_eq!(totals.len(), 2);
    let json = fs::read_to_string(folder.path().join("animate.json")).unwrap();
    assert_eq!(json.trim_end(), serde_json::to_string_pretty(&report).unwrap());
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["schema_version"], 1);
    let files: Vec<&str> =
        json["files"].as_array().unwrap().iter().map(|file| file.as_str().unwrap()).collect();
    for file in &files {
        assert!(folder.path().join(file).is_file(), "{file}");
    }
    for file in ["frames.csv", "totals.csv", "report.txt", "frame-time.png", "sah-cost.svg"] {
        assert!(files.contains(&file), "no {file} in {files:?}");
    }
    assert!(!folder.path().join("frames").exists(), "nobody asked for pictures");
    let text = animate_text(&report);
    for part in ["frames 1 to 3", "2 of 4 objects move", "bvh2:order=near", "agree on every ray"] {
        assert!(text.contains(part), "no {part} in:\n{text}");
    }
}

/// Who follows beside it changes nothing of its rays.
#[test]
fn what_builds_on_demand_may_be_the_only_backend() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene(86);
    let report = run(&scene, &plan(&scene, folder.path(), &["lazy"]), &|_, _| {}).unwrap();
    let with = plan(&scene, folder.path(), &["bvh2", "lazy"]);
    let with = run(&scene, &with, &|_, _| {}).unwrap();
    assert_eq!((report.backends.len(), report.rows.len()), (1, FRAMES));
    for (own, other) in report.rows.iter().zip(with.rows.iter().filter(|r| r.backend == "lazy")) {
        assert_eq!((own.rays, own.occluded_share), (other.rays, other.occluded_share));
        assert_eq!(other.differing_rays, 0);
    }
}

#[cfg(feature = "embree")]
#[test]
fn embree_follows_beside_native_trees() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene(83);
    let embrees = [
        "embree:mode=robust,quality=low",
        "embree:mode=robust,update=refit",
        "embree:mode=robust,update=refit,geometries=objects",
    ];
    let backends = [&["bvh8"], &embrees[..]].concat();
    let mut plan = plan(&scene, folder.path(), &backends);
    plan.quality = true;
    let report = run(&scene, &plan, &|_, _| {}).unwrap();
    for total in &report.totals {
        // Rays that graze edges.
        assert!(total.differing_per_million < 1e4, "{total:?}");
        assert!(total.most_memory_bytes.unwrap() > 0, "{total:?}");
    }
    let refit: Vec<_> = report.rows.iter().filter(|r| r.backend == embrees[1]).collect();
    assert!(refit[0].rebuilt && refit[0].refit_ms == 0.0, "{:?}", refit[0]);
    assert!(refit[1..].iter().all(|r| !r.rebuilt && r.refit_ms > 0.0 && r.update_ms >= r.refit_ms));
}

fn refused(scene: &Scene, plan: &Plan) -> String {
    let error = run(scene, plan, &|_, _| {}).expect_err("refused").to_string();
    assert!(!error.contains('\n'), "{error}");
    error
}

#[test]
fn what_cannot_be_followed_is_refused_before_anything_is_written() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("out");
    let scene = scene(84);
    let good = plan(&scene, &folder, &["bvh2"]);
    let still = Scene { motion: None, ..scene.clone() };
    assert!(refused(&still, &good).contains("does not move"));
    for (start, end, part) in
        [(0, 5, "has 4, from 0 to 3"), (3, 4, "at least two"), (usize::MAX, 1, "at least two")]
    {
        let frames = start..end;
        let plan = Plan { frames, ..good.clone() };
        assert!(refused(&scene, &plan).contains(part));
    }
    let twice = plan(&scene, &folder, &["bvh2", "bvh8", "bvh2"]);
    assert!(refused(&scene, &twice).contains("'bvh2' is given twice"));
    let none = plan(&scene, &folder, &[]);
    assert!(refused(&scene, &none).contains("at least one backend"));
    if !cfg!(feature = "embree") {
        let missing = plan(&scene, &folder, &["bvh2", "embree:update=refit"]);
        assert!(refused(&scene, &missing).contains("make setup"));
    }
    assert!(!folder.exists());
    fs::write(&folder, "a file").unwrap();
    assert!(refused(&scene, &good).contains("out"));
    assert_eq!(fs::read_to_string(&folder).unwrap(), "a file");
    fs::remove_file(&folder).unwrap();
    let mut away = scene;
    away.camera.eye = Vec3::new(0.0, 0.0, 100.0);
    away.camera.look_at = Vec3::new(0.0, 0.0, 200.0);
    assert!(refused(&away, &good).contains("in no frame"));
}

/// Times and thread counts apart, a run is a function of its input.
#[test]
fn answers_do_not_depend_on_threads() {
    let scene = scene(85);
    let of = |threads: usize| -> (AnimateReport, Vec<u8>) {
        let folder = tempfile::tempdir().unwrap();
        let plan = plan(&scene, folder.path(), &["bvh8", "bvh2"]);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let report = pool.install(|| run(&scene, &plan, &|_, _| {})).unwrap();
        (report, fs::read(folder.path().join("frames/frame_0003.exr")).unwrap())
    };
    let ((one, one_picture), (three, three_picture)) = (of(1), of(3));
    assert_eq!(one_picture, three_picture);
    for (a, b) in one.rows.iter().zip(&three.rows) {
        assert_eq!((a.rays, a.occluded_share), (b.rays, b.occluded_share));
    }
}
