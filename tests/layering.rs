//! Modules import downwards only: the table of `ARCHITECTURE.md`, held against the code.

use std::fs;
use std::path::{Path, PathBuf};

/// Each module and the layer that it lies in. A module may use those of lower layers, and those
/// named beside it.
const LAYERS: &[(&str, u32, &[&str])] = &[
    ("error", 0, &[]),
    ("filled", 0, &["huge_pages"]),
    ("huge_pages", 0, &[]),
    ("processor", 0, &[]),
    ("vectorized", 0, &[]),
    ("geometry", 1, &[]),
    ("output", 1, &[]),
    ("ray", 1, &[]),
    ("ray_set", 2, &[]),
    ("intersect", 2, &[]),
    ("scene", 3, &[]),
    ("tree", 3, &[]),
    ("build", 4, &[]),
    ("order", 4, &[]),
    ("trace", 4, &[]),
    ("dynamics", 5, &[]),
    ("parts", 5, &[]),
    ("arbiter", 6, &[]),
    ("backend", 6, &[]),
    ("measure", 7, &[]),
    ("render", 7, &[]),
    ("lab", 8, &[]),
    ("chart", 8, &[]),
    ("image_file", 8, &[]),
    ("report", 8, &[]),
    ("results", 9, &[]),
    ("animate", 10, &[]),
    ("bench", 10, &[]),
    ("converge", 10, &[]),
    ("stress", 10, &[]),
    ("truth", 10, &[]),
    ("cli", 11, &[]),
];

fn source_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            source_files(&path, files);
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
}

/// Modules named after `crate::`, outside tests, comments and strings.
fn imports(source: &str) -> Vec<String> {
    let code = source.split("#[cfg(test)]").next().unwrap_or_default();
    let mut modules = Vec::new();
    for line in code.lines().map(str::trim).filter(|l| !l.starts_with("//")) {
        for (place, _) in line.match_indices("crate::") {
            let rest = &line[place + "crate::".len()..];
            // `use crate::{Error, order, build}` names several.
            let names = match rest.strip_prefix('{') {
                Some(group) => group.split(',').collect(),
                None => vec![rest],
            };
            for name in names {
                let name: String =
                    name.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                if name.starts_with(char::is_lowercase) {
                    modules.push(name);
                }
            }
        }
    }
    modules
}

#[test]
fn modules_import_downwards() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    source_files(&root, &mut files);
    assert!(files.len() > 30, "{} files", files.len());
    let layer = |module: &str| LAYERS.iter().find(|l| l.0 == module);
    let mut faults = Vec::new();
    for file in files {
        let relative = file.strip_prefix(&root).unwrap();
        let first = relative.components().next().unwrap().as_os_str().to_str().unwrap();
        let module = first.trim_end_matches(".rs");
        // Unit tests of a module may use what they like.
        let is_test = relative.file_stem().is_some_and(|s| s == "tests");
        if ["lib", "main"].contains(&module) || is_test {
            continue;
        }
        let Some(own) = layer(module) else {
            faults.push(format!("{module} is in no layer: add it to tests/layering.rs"));
            continue;
        };
        for import in imports(&fs::read_to_string(&file).unwrap()) {
            // Modules that exist in tests only share the suites' random geometry.
            let allowed = import == module
                || import.starts_with("test_")
                || own.2.contains(&import.as_str())
                || layer(&import).is_some_and(|other| other.1 < own.1);
            if !allowed {
                faults.push(format!("{} uses {import}", relative.display()));
            }
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

/// Orders and kernels never see each other, builders know neither: children of one layer are kept
/// apart by the table above; this says so of the table itself.
#[test]
fn builders_orders_and_kernels_share_a_layer() {
    let layer = |module: &str| LAYERS.iter().find(|l| l.0 == module).unwrap().1;
    assert_eq!(layer("build"), layer("order"));
    assert_eq!(layer("order"), layer("trace"));
}
