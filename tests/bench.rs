//! `sato bench` on a small scene, end to end: every experiment, its files and its record.

use assert_cmd::Command;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use serde_json::Value;
use std::collections::HashSet;
use std::fs;
use std::path::Path;

fn sato() -> Command {
    Command::new(env!("CARGO_BIN_EXE_sato"))
}

fn rows<'a>(report: &'a Value, experiment: &str) -> &'a [Value] {
    report["experiments"][experiment].as_array().map_or(&[], Vec::as_slice)
}

fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or_else(|| panic!("no {key} in {row}"))
}

#[test]
fn every_experiment_leaves_rows_tables_and_charts() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("bench");
    sato()
        .args(["bench", "--quick", "--scene", "ship", "--size", "32", "18", "--rounds", "2"])
        .args(["--threads", "2", "-o"])
        .arg(&out)
        .assert()
        .success()
        .stdout(contains("order-time").and(contains("N0 N2 N4 T2 T3 N1 T0")));
    let report: Value =
        serde_json::from_str(&fs::read_to_string(out.join("report.json")).unwrap()).unwrap();
    assert_eq!(report["settings"]["size"], serde_json::json!([32, 18]));
    for experiment in sato::bench::EXPERIMENTS {
        let rows = rows(&report, experiment.name);
        if !experiment.of_the_paper {
            assert!(rows.is_empty(), "{} was not asked for", experiment.name);
            continue;
        }
        assert!(!rows.is_empty(), "{}", experiment.name);
        let csv = fs::read_to_string(out.join(format!("{}.csv", experiment.name))).unwrap();
        assert_eq!(csv.lines().count(), rows.len() + 1, "{}", experiment.name);
    }
    let files: Vec<&str> =
        report["files"].as_array().unwrap().iter().map(|f| f.as_str().unwrap()).collect();
    assert!(files.len() > 30, "{files:?}");
    for file in &files {
        assert!(fs::metadata(out.join(file)).unwrap().len() > 0, "{file}");
    }
    check_orders(&report);
    check_speed_ups(&report);
    check_similarity(&report);
}

/// Every order is timed, with the paper's figure where there is one.
fn check_orders(report: &Value) {
    let rows = rows(report, "order-time");
    let names: HashSet<&str> = rows.iter().map(|r| r["order"].as_str().unwrap()).collect();
    for order in sato::order::ORDERS.iter().filter(|o| !["near", "far"].contains(&o.name)) {
        assert!(names.contains(order.name), "{}", order.name);
    }
    let paper = rows.iter().filter(|r| !r["paper_ms"].is_null()).count();
    assert_eq!(paper, 6 + 5, "six orders of the binary tree, five of the kd-tree");
    assert!(rows.iter().all(|r| number(r, "order_ms_min") <= number(r, "order_ms")));
}

/// Parts add up, open rays visit the same nodes under every order, front to back is 1.
fn check_speed_ups(report: &Value) {
    let rows = rows(report, "speed-up");
    let traversals: HashSet<(&str, &str)> = rows
        .iter()
        .map(|r| (r["structure"].as_str().unwrap(), r["trace"].as_str().unwrap()))
        .collect();
    assert_eq!(
        traversals,
        HashSet::from([("bvh2", "single"), ("bvh2", "packet"), ("kd", "single")])
    );
    for row in rows {
        let is = |key: &str, value: &str| row[key] == value;
        if is("order", "near") {
            assert!((number(row, "speed_up") - 1.0).abs() < 1e-12, "{row}");
        }
        if is("subset", "open") && is("trace", "single") {
            assert!((number(row, "nodes_to_near") - 1.0).abs() < 1e-12, "{row}");
        }
        if is("subset", "all") {
            let part = |subset: &str| {
                let same = ["rays", "structure", "trace", "order"];
                rows.iter()
                    .find(|r| r["subset"] == subset && same.iter().all(|key| r[*key] == row[*key]))
                    .map_or(0.0, |r| number(r, "ray_count"))
            };
            assert!((part("open") + part("occluded") - number(row, "ray_count")).abs() < 0.5);
        }
    }
}

fn check_similarity(report: &Value) {
    for row in rows(report, "similarity") {
        let (share, by_area) = (number(row, "equal_share"), number(row, "equal_share_by_area"));
        match row["order"].as_str().unwrap() {
            "node-sato" => assert!(share > 1.0 - 1e-12 && by_area > 1.0 - 1e-12, "{row}"),
            "random" => assert!((share - 0.5).abs() < 0.06, "{row}"),
            _ => assert!((0.0..=1.0).contains(&share), "{row}"),
        }
    }
}

#[test]
fn one_experiment_alone_and_what_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("x");
    sato()
        .args(["bench", "example", "--quick", "--scene", "ship", "--quiet", "-o"])
        .arg(&out)
        .assert()
        .success()
        .stdout("");
    assert!(out.join("example.csv").exists() && !out.join("speed-up.csv").exists());
    let refused = |arguments: &[&str], message: &str| {
        let fresh = folder.path().join("refused");
        let mut command = sato();
        command.args(["bench", "-o"]).arg(&fresh).args(arguments);
        command.assert().code(2).stderr(contains(message));
        assert!(!Path::new(&fresh).exists(), "{arguments:?}");
    };
    refused(&["speed"], "order-time");
    refused(&["--scene", "nowhere"], "no scene");
    refused(&["example", "--scene", "ship", "--size", "0", "9", "--rounds", "0"], "rounds");
    refused(&["limits", "--scene", "ship", "--size", "0", "9"], "no pixels");
    refused(&["limits", "--scene", "ship", "--backend", "kd"], "--backend: only taken by: peers");
    refused(&["peers", "--scene", "ship", "--backend", "bvh9"], "no backend 'bvh9'");
}

#[cfg(not(feature = "embree"))]
#[test]
fn without_embree_there_are_no_peers_and_the_error_says_how_to_get_them() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("x");
    sato()
        // Experiments that could run do not either.
        .args(["bench", "order-time", "peers", "--scene", "ship", "-o"])
        .arg(&out)
        .assert()
        .code(1)
        .stderr(contains("make setup").and(contains("--features embree")));
    assert!(!out.exists());
}

#[cfg(feature = "embree")]
mod peers {
    use super::*;

    const ADDED: &str = "bvh2:trace=packet";

    fn text<'a>(row: &'a Value, key: &str) -> &'a str {
        row[key].as_str().unwrap_or_else(|| panic!("no {key} in {row}"))
    }

    fn is_embree(row: &Value) -> bool {
        text(row, "backend").starts_with("embree")
    }

    #[test]
    fn all_contenders_in_all_cells() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("bench");
        sato()
            .args(["bench", "peers", "--quick", "--scene", "ship", "--size", "32", "18"])
            .args([
                "--rounds",
                "2",
                "--threads",
                "2",
                "--backend",
                ADDED,
                "--backend",
                "bvh8",
                "-o",
            ])
            .arg(&out)
            .assert()
            .success()
            .stdout(contains("least of bvh8:").and(contains("agree on all")));
        let report: Value =
            serde_json::from_str(&fs::read_to_string(out.join("report.json")).unwrap()).unwrap();
        assert_eq!(report["settings"]["backends"], serde_json::json!([ADDED, "bvh8"]));
        for record in ["peers", "peers-builds", "peers-means"] {
            let csv = fs::read_to_string(out.join(format!("{record}.csv"))).unwrap();
            assert_eq!(csv.lines().count(), rows(&report, record).len() + 1, "{record}");
        }
        for chart in ["single-threads-1", "single-threads-2", "means-single"] {
            for chart in [chart.to_string(), chart.replace("single", "best")] {
                for extension in ["png", "svg"] {
                    let file = out.join(format!("peers-{chart}.{extension}"));
                    assert!(fs::metadata(&file).unwrap().len() > 1000, "{file:?}");
                }
            }
        }
        check_cells(rows(&report, "peers"));
        check_means(rows(&report, "peers-means"), rows(&report, "peers"));
        check_builds(rows(&report, "peers-builds"));
    }

    /// Every cell has every contender; native answers are the same in all, whatever the threads and
    /// the arrangement; ratios are there for native contenders, and the best is no worse than single.
    fn check_cells(rows: &[Value]) {
        let backends: HashSet<&str> = rows.iter().map(|r| text(r, "backend")).collect();
        assert!(backends.contains(ADDED), "{backends:?}");
        // Three native ones, Embree's twelve, and one of the two asked for: the other is there.
        assert_eq!(backends.len(), 3 + 2 * 3 * 2 + 1, "{backends:?}");
        assert_eq!(rows.len(), backends.len() * 3 * 3 * 2);
        for row in rows {
            let cell = ["rays", "arrangement", "threads"];
            let others = || rows.iter().filter(|r| cell.iter().all(|key| r[*key] == row[*key]));
            assert_eq!(others().count(), backends.len());
            let like = rows.iter().filter(|r| r["rays"] == row["rays"]);
            for other in like.filter(|_| !is_embree(row)) {
                assert_eq!(number(row, "ray_count"), number(other, "ray_count"));
                if !is_embree(other) {
                    assert_eq!(number(row, "occluded_share"), number(other, "occluded_share"));
                }
            }
            assert!(number(row, "trace_ms_min") <= number(row, "trace_ms"));
            assert!((0.0..=1.0).contains(&number(row, "occluded_share")));
            if is_embree(row) {
                assert!(row["ratio_to_single"].is_null() && row["best"].is_null(), "{row}");
                assert!(text(row, "notes").contains("Embree 4."), "{row}");
                // Watertight or not, nearly all answers are the same.
                assert!(number(row, "differing_rays") <= 0.01 * number(row, "ray_count"));
                continue;
            }
            assert_eq!(number(row, "differing_rays"), 0.0, "{row}");
            let (single, best) = (number(row, "ratio_to_single"), number(row, "ratio_to_best"));
            assert!(best > 0.0 && best <= single && single.is_finite(), "{row}");
            assert!(text(row, "single").contains("width=1,"), "{row}");
            for (name, ratio) in [("single", single), ("best", best)] {
                let reference = others().find(|r| r["backend"] == row[name]).unwrap();
                // A ratio of two rounds lies within what their extremes allow.
                let least = number(reference, "trace_ms_min") / number(row, "trace_ms_max");
                let most = number(reference, "trace_ms_max") / number(row, "trace_ms_min");
                assert!((least..=most).contains(&ratio), "{row}");
            }
        }
        let rays: HashSet<&str> = rows.iter().map(|r| text(r, "rays")).collect();
        assert_eq!(rays, HashSet::from(["ao", "ao-unbounded", "shadow"]));
    }

    fn check_means(means: &[Value], rows: &[Value]) {
        // References, numbers of threads and any, groups, native contenders.
        assert_eq!(means.len(), 2 * 3 * (1 + 3 + 3) * 4);
        for mean in means {
            let key = format!("ratio_to_{}", text(mean, "reference"));
            let group = text(mean, "group");
            let ratios: Vec<f64> = rows
                .iter()
                .filter(|r| r["backend"] == mean["backend"])
                .filter(|r| mean["threads"].is_null() || r["threads"] == mean["threads"])
                .filter(|r| group == "all" || r["rays"] == group || r["arrangement"] == group)
                .map(|r| number(r, &key))
                .collect();
            assert_eq!(ratios.len() as f64, number(mean, "cells"), "{mean}");
            let product: f64 = ratios.iter().product();
            let wanted = product.powf(1.0 / ratios.len() as f64);
            assert!((number(mean, "ratio") / wanted - 1.0).abs() < 1e-9, "{mean}");
            let least = ratios.iter().copied().fold(f64::INFINITY, f64::min);
            assert_eq!(number(mean, "least_ratio"), least, "{mean}");
            assert!(text(mean, "least_cell").starts_with("ship, "), "{mean}");
        }
    }

    fn check_builds(rows: &[Value]) {
        let built: Vec<(&str, f64)> =
            rows.iter().map(|r| (text(r, "backend"), number(r, "threads"))).collect();
        let trees = ["bvh8", "embree:quality=high", "embree:quality=medium", "bvh2"];
        let wanted: Vec<(&str, f64)> =
            [1.0, 2.0].iter().flat_map(|&threads| trees.map(|tree| (tree, threads))).collect();
        assert_eq!(built, wanted);
        for row in rows {
            assert!(number(row, "total_ms_min") > 0.0 && number(row, "ratio_to_medium") > 0.0);
            let bytes = number(row, "memory_bytes");
            assert!(bytes > 100_000.0, "{row}");
            let with_mesh = bytes + number(row, "mesh_bytes");
            assert_eq!(number(row, "memory_with_mesh_bytes"), with_mesh);
            if text(row, "backend") == "embree:quality=medium" {
                assert_eq!(number(row, "ratio_to_medium"), 1.0);
            }
        }
    }
}
