//! Loaders take paths: one file, in memory where the system has such a folder, written again and
//! again.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// The file `name` with `content`, beside a mesh `t.obj` that scenes may name.
pub fn written(name: &str, content: &[u8]) -> PathBuf {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let memory = Path::new("/dev/shm");
        let parent = if memory.is_dir() { memory.to_path_buf() } else { std::env::temp_dir() };
        let folder = tempfile::tempdir_in(parent).expect("a folder");
        let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        std::fs::write(folder.path().join("t.obj"), mesh).expect("written");
        folder
    });
    let path = folder.path().join(name);
    std::fs::write(&path, content).expect("written");
    path
}

/// Whatever the file holds, loading it ends in a sound scene or in one clear line.
#[allow(dead_code, reason = "not every target loads a scene")]
pub fn check_scene(name: &str, content: &[u8]) {
    match sato::scene::load(written(name, content)) {
        Ok(scene) => {
            assert_eq!(scene.check(), Ok(()));
            assert!(!scene.mesh.is_empty());
            let finite = |i| scene.mesh.triangle(i).0.iter().all(|v| v.is_finite());
            assert!((0..scene.mesh.len()).all(finite));
        }
        Err(error) => check_error(&error),
    }
}

/// One line without control characters.
pub fn check_error(error: &sato::Error) {
    let message = error.to_string();
    assert!(!message.chars().any(char::is_control), "{message:?}");
}
