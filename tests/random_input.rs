//! Input made by chance: whatever it is, loading ends in a sound scene or in one clear line.

use proptest::prelude::*;
use sato::scene::load;
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn write(folder: &TempDir, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, content).unwrap();
    path
}

/// Loads `content`, whatever comes of it, and holds the result to what every scene promises.
fn check_promises(folder: &TempDir, name: &str, content: &[u8]) {
    match load(write(folder, name, content)) {
        Ok(scene) => {
            assert_eq!(scene.check(), Ok(()));
            assert!(!scene.mesh.is_empty());
            let finite = |i| scene.mesh.triangle(i).0.iter().all(|v| v.is_finite());
            assert!((0..scene.mesh.len()).all(finite));
        }
        Err(error) => {
            let message = error.to_string();
            assert!(!message.chars().any(char::is_control), "{message:?}");
        }
    }
}

/// Something like an OBJ file.
fn obj_like() -> impl Strategy<Value = String> {
    let word = prop_oneof![
        "-?[0-9]{1,3}",
        "[0-9]{1,20}(/-?[0-9]{0,20}){0,3}",
        "-?[0-9]{0,2}\\.[0-9]{0,3}(e-?[0-9]{1,3})?",
        "nan|inf|-inf|#|\\\\|//|v|f|1|2|3",
    ];
    let line = ("v|f|f|l|vt|g|#|", proptest::collection::vec(word, 0..8), "\n|\r\n|\r|\\\\\n");
    proptest::collection::vec(line, 0..20).prop_map(|lines| {
        let text = |(key, words, end): (String, Vec<String>, String)| {
            format!("{key} {}{end}", words.join(" "))
        };
        TRIANGLE.to_owned() + &lines.into_iter().map(text).collect::<String>()
    })
}

/// `text` with some bytes changed, and cut.
fn mutated(text: Vec<u8>) -> impl Strategy<Value = Vec<u8>> {
    let length = text.len();
    let changes = proptest::collection::vec((0..length, any::<u8>()), 0..4);
    (changes, 0..=length, any::<bool>()).prop_map(move |(changes, cut, whole)| {
        let mut text = text.clone();
        changes.into_iter().for_each(|(at, byte)| text[at] = byte);
        text.truncate(if whole { length } else { cut });
        text
    })
}

fn compressed_triangle() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let scene = load(write(&folder, "t.obj", TRIANGLE)).unwrap();
    let path = folder.path().join("t.obj.zst");
    sato::scene::export(&scene, &path).unwrap();
    fs::read(path).unwrap()
}

fn whole_scene() -> Vec<u8> {
    "[[geometry]]\nfile = 't.obj'\nscale = 2\n[camera]\neye = [0, 0, 5]\nlook_at = [0, 0, 0]\n\
        [[light]]\ntype = 'point'\nposition = [0, 3, 0]\n"
        .into()
}

proptest! {
    #[test]
    fn no_bytes_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        let folder = tempfile::tempdir().unwrap();
        for name in ["x.obj", "x.toml", "x.obj.zst"] {
            check_promises(&folder, name, &bytes);
        }
    }

    #[test]
    fn nothing_like_an_obj_panics(text in obj_like()) {
        check_promises(&tempfile::tempdir().unwrap(), "x.obj", text.as_bytes());
    }

    #[test]
    fn no_altered_file_panics(
        obj in mutated(TRIANGLE.into()),
        scene in mutated(whole_scene()),
        compressed in mutated(compressed_triangle()),
    ) {
        let folder = tempfile::tempdir().unwrap();
        write(&folder, "t.obj", TRIANGLE);
        check_promises(&folder, "x.obj", &obj);
        check_promises(&folder, "x.toml", &scene);
        check_promises(&folder, "x.obj.zst", &compressed);
    }
}
