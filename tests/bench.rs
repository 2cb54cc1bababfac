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
}
