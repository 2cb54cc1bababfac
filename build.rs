//! Under the feature `embree`: finds Embree 4, links it with an rpath, and binds
//! `vendor-headers/embree4_abi.h`. Without it, nothing.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    #[cfg(feature = "embree")]
    if let Err(message) = embree::set_up() {
        // One line; what cargo prints for a panic would bury it.
        println!("cargo::error={message}");
    }
}

#[cfg(feature = "embree")]
mod embree {
    use std::env;
    use std::path::{Path, PathBuf};

    const HEADER: &str = "vendor-headers/embree4_abi.h";
    /// Where `scripts/setup.sh` puts what it fetches.
    const FETCHED: &str = "third-party/embree";
    /// Where systems keep libraries; `scripts/setup.sh` reads the same list.
    const LIBRARY_DIRS: &str = "scripts/library-dirs.txt";

    pub(crate) fn set_up() -> Result<(), String> {
        let root = PathBuf::from(variable("CARGO_MANIFEST_DIR"));
        println!("cargo::rerun-if-changed={HEADER}");
        println!("cargo::rerun-if-changed={LIBRARY_DIRS}");
        println!("cargo::rerun-if-env-changed=EMBREE_DIR");

        let dir = find_library(&root)?;
        let library = dir.join(library_name(4));
        println!("cargo::rerun-if-changed={}", library.display());
        println!("cargo::rustc-link-search=native={}", dir.display());
        // The binary looks where the linker did, and where a symlink found there leads to: the name
        // that it looks for may exist only there.
        let real = library.canonicalize().ok().and_then(|file| file.parent().map(Path::to_owned));
        let same = dir.canonicalize().ok() == real;
        for folder in [Some(dir), real.filter(|_| !same)].into_iter().flatten() {
            // -Xlinker, not -Wl: folders may have commas in their names.
            for arg in ["-Xlinker", "-rpath", "-Xlinker", &folder.display().to_string()] {
                println!("cargo::rustc-link-arg={arg}");
            }
        }
        bind(&root)
    }

    fn variable(name: &str) -> String {
        env::var(name).unwrap_or_else(|_| panic!("cargo sets {name}"))
    }

    fn library_name(major: u32) -> String {
        let suffix = if variable("CARGO_CFG_TARGET_OS") == "macos" { "dylib" } else { "so" };
        format!("libembree{major}.{suffix}")
    }

    /// The folder of a linkable Embree 4: that of `EMBREE_DIR`, else what setup fetched, else the
    /// system's.
    fn find_library(root: &Path) -> Result<PathBuf, String> {
        let multiarch = format!("{}-linux-gnu", variable("CARGO_CFG_TARGET_ARCH"));
        let holds = |dir: &PathBuf, major| dir.join(library_name(major)).exists();

        if let Some(given) = env::var_os("EMBREE_DIR").filter(|given| !given.is_empty()) {
            let given = root.join(given);
            let dirs = ["lib", "lib64", &format!("lib/{multiarch}"), ""].map(|sub| given.join(sub));
            return dirs.iter().find(|dir| holds(dir, 4)).cloned().ok_or_else(|| {
                let found = match dirs.iter().any(|dir| holds(dir, 3)) {
                    true => "Embree 3, which is too old".to_string(),
                    false => format!("no {} (looked in lib, lib64 and itself)", library_name(4)),
                };
                format!("EMBREE_DIR={} holds {found}: point it at Embree 4", given.display())
            });
        }

        let fetched = root.join(FETCHED).join("lib");
        if holds(&fetched, 4) {
            return Ok(fetched);
        }

        let list = root.join(LIBRARY_DIRS);
        let list = std::fs::read_to_string(&list).map_err(|e| format!("{LIBRARY_DIRS}: {e}"))?;
        let dirs: Vec<PathBuf> = list
            .lines()
            .filter(|line| !line.is_empty() && !line.starts_with('#'))
            // Another machine's libraries may lie beside ours.
            .filter(|line| !line.ends_with("-linux-gnu") || line.ends_with(&multiarch))
            .map(PathBuf::from)
            .collect();
        dirs.iter().find(|dir| holds(dir, 4)).cloned().ok_or_else(|| {
            let older = match dirs.iter().find(|dir| holds(dir, 3)) {
                Some(dir) => format!(" (the Embree 3 in {} is too old)", dir.display()),
                None => String::new(),
            };
            format!("found no Embree 4{older}: run `make setup`, or set EMBREE_DIR, or build without `--features embree`")
        })
    }

    fn bind(root: &Path) -> Result<(), String> {
        // bindgen panics where there is no libclang, and its hook would print before we can.
        let hook = std::panic::take_hook();
        std::panic::set_hook(Box::new(|_| {}));
        let version = std::panic::catch_unwind(bindgen::clang_version);
        std::panic::set_hook(hook);
        if version.is_err() {
            return Err("found no libclang: run `make setup`, or set LIBCLANG_PATH, or build without `--features embree`".into());
        }

        let bindings = bindgen::Builder::default()
            .header(root.join(HEADER).display().to_string())
            .parse_callbacks(Box::new(bindgen::CargoCallbacks::new()))
            .allowlist_item("RTC.*|rtc.*|SATO_.*|Sato.*")
            // The layout is checked against embree4-sys in src/backend/embree/abi.rs.
            .layout_tests(false)
            .generate()
            .map_err(|e| format!("{HEADER}: {e}"))?;
        let out = Path::new(&variable("OUT_DIR")).join("embree4_abi.rs");
        bindings.write_to_file(&out).map_err(|e| format!("{}: {e}", out.display()))
    }
}
