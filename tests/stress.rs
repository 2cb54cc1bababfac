//! A short run of the stress suite, and the command around it.

use assert_cmd::Command;
use predicates::prelude::*;
use predicates::str::contains;
use sato::backend::BackendSpec;
use sato::stress::{self, CASES, Settings, StressReport};
use std::fs;
use std::path::Path;
use std::time::Duration;

/// Cases of closed meshes: a watertight test of shared edges is enough not to be wrong there.
const CLOSED: [&str; 11] = [
    "icosphere",
    "cube",
    "tessellated-box",
    "torus",
    "scaled-by-2",
    "scaled-by-10",
    "far-million",
    "far-embree",
    "sliver-sphere",
    "duplicates",
    "non-finite-vertices",
];

fn settings(backends: Vec<BackendSpec>, answers: u64) -> Settings {
    let cases = CASES.to_vec();
    Settings { cases, backends, answers, time_limit: None, seed: 7, folder: None }
}

fn run(settings: &Settings) -> StressReport {
    println!("seed {}", settings.seed);
    stress::run(settings, &|_, _| {}).unwrap()
}

/// One backend of each kind, and all that say they are exact, by default settings but for the mode.
fn backends() -> Vec<BackendSpec> {
    let some = [
        "brute",
        "bvh2:order=near",
        "bvh2:builder=spatial,trace=packet",
        "bvh8",
        "kd",
        "bvh2:mode=fast",
        "bvh8:mode=fast",
    ];
    let mut specs: Vec<BackendSpec> = some.iter().map(|text| text.parse().unwrap()).collect();
    let by_default = |spec: &BackendSpec| {
        spec.entry().keys.iter().all(|k| k.name == "mode" || spec.value(k.name) == k.default)
    };
    let others = stress::all_backends().into_iter().filter(by_default);
    specs.extend(others.filter(|s| stress::is_exact(s) || !stress::is_native(s)));
    let mut full = Vec::new();
    specs.retain(|spec| {
        let is_new = !full.contains(&spec.full());
        full.push(spec.full());
        is_new
    });
    specs
}

#[test]
fn closed_meshes_do_not_leak_and_exact_backends_are_never_wrong() {
    let specs = backends();
    let answers = 3000 * (CASES.len() * specs.len()) as u64;
    let report = run(&settings(specs.clone(), answers));
    assert_eq!(report.cases.len(), CASES.len());
    for case in &report.cases {
        assert!(case.is_complete && case.rays >= 1000, "{}: {} rays", case.case, case.rays);
        let may_be_open = !CLOSED.contains(&case.case.as_str());
        assert!(may_be_open || case.occluded == case.rays, "{}: not closed", case.case);
        for (result, spec) in case.results.iter().zip(&specs).filter(|(_, s)| stress::is_native(s))
        {
            let wrong = &result.wrong;
            assert!(result.answers > 0, "{}: {spec} was not asked", case.case);
            assert!(may_be_open || wrong.total() == 0, "{}: {spec}: {wrong:?}", case.case);
            let explained: u64 = wrong.reasons.iter().map(|r| r.false_hits + r.missed_hits).sum();
            assert_eq!(explained, wrong.total(), "{}: {spec}", case.case);
        }
    }
    // That wrong answers are found at all: fast tests round in the planes of triangles.
    let planes = report.cases.iter().find(|c| c.case == "triangle-planes").unwrap();
    let fast = specs.iter().position(|s| stress::is_native(s) && !stress::is_exact(s)).unwrap();
    assert!(planes.results[fast].wrong.total() > 0, "{:?}", planes.results[fast]);
    stress::check(&report).unwrap();
}

/// A ray is a function of seed, case and index: not of threads, and not of who answers.
#[test]
fn a_run_can_be_repeated() {
    let few = |threads: usize, specs: &[&str]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let specs: Vec<BackendSpec> = specs.iter().map(|s| s.parse().unwrap()).collect();
        let answers = 700 * (CASES.len() * specs.len()) as u64;
        let report = pool.install(|| run(&settings(specs, answers)));
        let last = report.cases.iter().map(|c| c.results.last().unwrap().wrong.clone());
        (last.collect::<Vec<_>>(), report.cases.iter().map(|c| c.occluded).collect::<Vec<_>>())
    };
    assert_eq!(few(1, &["bvh2"]), few(3, &["kd", "bvh2"]));
}

#[test]
fn an_exact_backend_that_is_wrong_fails_the_check() {
    let mut quick = settings(vec!["bvh2".parse().unwrap()], 100);
    quick.cases.truncate(1);
    let mut report = run(&quick);
    stress::check(&report).unwrap();
    report.totals[0].is_exact = true;
    report.totals[0].wrong.false_hits = 1;
    assert_eq!(stress::check(&report).unwrap_err().exit_status(), 3);
}

fn sato(folder: &Path) -> Command {
    let mut command = Command::cargo_bin("sato").unwrap();
    command.current_dir(folder).env_remove("SATO_SCENES");
    command
}

#[test]
fn wrong_rays_are_saved_for_replay() {
    let folder = tempfile::tempdir().unwrap();
    sato(folder.path())
        .args(["stress", "--case", "triangle-planes", "--backend", "bvh2:mode=fast"])
        .args(["--backend", "kd:mode=fast"])
        .args(["--rays", "20000", "--json", "x.json", "-o", "out"])
        .assert()
        .success()
        .stdout(contains("triangle-planes").and(contains("near-parallel")));
    let text = fs::read_to_string(folder.path().join("x.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!((&report["schema_version"], &report["answers"]), (&1.into(), &20_000.into()));
    assert!(report["totals"][0]["reasons"].as_array().is_some_and(|r| !r.is_empty()));
    // All rays there are wrong; asked again, the backends still agree, and the arbiter still differs.
    sato(folder.path())
        .args(["rays", "replay", "out/triangle-planes.rays", "--rounds", "1"])
        .args(["--backend", "brute:mode=fast", "--backend", "bvh2:mode=fast"])
        .assert()
        .success()
        .stdout(contains("of 8 rays that all agree on, 8 are wrong"));
}

#[test]
fn the_time_limit_is_kept_and_nonsense_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let limit = Duration::from_secs(2);
    let begun = std::time::Instant::now();
    sato(folder.path())
        .args(["stress", "--backend", "bvh8", "--rays", "1000000000000", "--time-limit", "2"])
        .args(["--case", "icosphere", "--case", "scaled-by-2"])
        .assert()
        .success()
        .stdout(contains("cut short by the time limit"));
    assert!(begun.elapsed() < limit * 15, "{:?}", begun.elapsed());
    for bad in [
        ["--case", "sideways"],
        ["--rays", "0"],
        ["--time-limit", "0"],
        ["--time-limit", "nan"],
        ["--backend", "bvh3"],
    ] {
        sato(folder.path()).arg("stress").args(bad).assert().code(2);
    }
}
