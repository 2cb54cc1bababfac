//! Open sets have one catalogue each: every file is listed, names are unique and documented.

mod common;

use sato::backend::catalogue::BACKENDS;
use std::collections::HashSet;
use std::fs;
use std::path::Path;

fn check_names<'a>(what: &str, entries: impl Iterator<Item = (&'a str, &'a str)>) {
    let mut seen = HashSet::new();
    for (name, about) in entries {
        assert!(seen.insert(name), "{what} {name} is listed twice");
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        assert!(!name.is_empty() && name.chars().all(plain), "{what} {name:?}");
        assert!(about.len() > 6 && !about.contains('\n'), "{what} {name}: {about:?}");
    }
    assert!(!seen.is_empty(), "no {what}");
}

#[test]
fn names_are_unique_and_documented() {
    check_names("backend", BACKENDS.iter().map(|e| (e.name, e.about)));
    check_names("builder", sato::build::BUILDERS.iter().map(|e| (e.name, e.about)));
    check_names("order", sato::order::ORDERS.iter().map(|e| (e.name, e.about)));
    check_names("experiment", sato::bench::EXPERIMENTS.iter().map(|e| (e.name, e.about)));
    check_names("generator", sato::scene::generate::GENERATORS.iter().map(|e| (e.name, e.about)));
    check_names("renderer", sato::converge::PRESETS.iter().map(|p| (p.name, p.about)));
    check_names("case", sato::stress::CASES.iter().map(|c| (c.name, c.about)));
    check_names("closed form", sato::truth::CASES.iter().map(|c| (c.name, c.about)));
    check_names("sampler", sato::render::SAMPLERS.iter().map(|s| (s.name, s.about)));
    let ways = sato::render::LightSampling::ALL;
    check_names("light sampling", ways.iter().map(|w| (w.name(), w.about())));
    check_names("skip", sato::render::Skip::ALL.iter().map(|s| (s.name(), s.about())));
    for backend in BACKENDS {
        check_names(
            "key",
            backend.all_keys().map(|k| (k.name, k.about)).chain([("none", "no key at all")]),
        );
        for key in backend.all_keys() {
            let choices = (key.choices)();
            check_names(key.name, choices.iter().map(|c| (c.name, c.about)));
            assert!(choices.iter().any(|c| c.name == key.default), "{}: default", key.name);
        }
    }
}

/// A file with an entry that the catalogue beside it does not list would be dead code.
#[test]
fn every_file_with_an_entry_is_listed() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for (folder, catalogue) in [
        ("backend", "backend/catalogue.rs"),
        ("build", "build/mod.rs"),
        ("order", "order/mod.rs"),
        ("scene/generate", "scene/generate/mod.rs"),
        ("bench", "bench/mod.rs"),
        ("stress/cases", "stress/cases/mod.rs"),
        ("truth", "truth/mod.rs"),
        ("render/sampler", "render/sampler/mod.rs"),
    ] {
        let list = fs::read_to_string(source.join(catalogue)).unwrap();
        for file in fs::read_dir(source.join(folder)).unwrap() {
            let path = file.unwrap().path();
            let Ok(text) = fs::read_to_string(&path) else { continue };
            let module = path.file_stem().unwrap().to_str().unwrap();
            for line in text.lines().filter(|l| l.contains("static ") && l.contains("Entry = ")) {
                let name = line.split("static ").nth(1).unwrap().split(':').next().unwrap();
                let listed = format!("{module}::{name}");
                assert!(list.contains(&listed), "add `&{listed}` to src/{catalogue}");
            }
        }
    }
}

#[test]
fn every_combination_parses_to_itself() {
    let specs = common::all_specs();
    assert!(specs.len() >= 5, "{specs:?}");
    for spec in specs {
        assert_eq!(spec.full().parse::<sato::backend::BackendSpec>().unwrap().full(), spec.full());
    }
}
