//! The catalogue of file formats: one file each, and its line in [`FORMATS`].

use super::mesh_builder::MeshPart;
use super::{Object, Scene, obj, toml_file, zstd};
use crate::error::one_line;
use crate::{Error, Result};
use std::ffi::OsStr;
use std::fs;
use std::path::Path;

/// All formats. Each may be compressed: with `.zst` after its extension.
pub static FORMATS: &[&Format] = &[&toml_file::FORMAT, &obj::FORMAT];

/// A file format that [`load`](super::load) reads.
#[derive(Debug)]
pub struct Format {
    /// File name extensions without the dot, lower case.
    pub extensions: &'static [&'static str],
    /// What it is, in a line.
    pub about: &'static str,
    pub(super) reader: Reader,
}

/// What becomes of the bytes of the file at the path.
#[derive(Debug)]
pub(super) enum Reader {
    /// A whole scene.
    Scene(fn(&Path, &[u8]) -> Result<Scene>),
    /// Triangles, which a scene file may name and which make a scene by themselves too.
    Mesh(fn(&Path, &[u8]) -> Result<MeshFile>),
}

/// A mesh as read: finite, coordinates in range, at least one triangle.
#[derive(Debug)]
pub(super) struct MeshFile {
    pub(super) part: MeshPart,
    /// All of it: each with vertices of its own.
    pub(super) objects: Vec<Object>,
    /// Vertices in the file, used or not.
    pub(super) vertices_in_file: usize,
    /// Triangles left out because a vertex is not finite.
    pub(super) triangles_dropped: usize,
    pub(super) warnings: Vec<String>,
}

/// The format of `path` by its name, and whether it is compressed. A bare `.zst` is taken for OBJ.
pub(super) fn of(path: &Path) -> Option<(&'static Format, bool)> {
    let extension_of = |path: &Path| path.extension().map(OsStr::to_ascii_lowercase);
    let outer = extension_of(path)?;
    let compressed = outer == "zst";
    let inner = if compressed { extension_of(Path::new(path.file_stem()?)) } else { Some(outer) };
    match inner {
        Some(inner) => FORMATS
            .iter()
            .find(|format| format.extensions.iter().any(|&e| inner == e))
            .map(|format| (*format, compressed)),
        None => Some((&obj::FORMAT, true)),
    }
}

/// The bytes of `path`, decompressed if asked for.
pub(super) fn read(path: &Path, compressed: bool) -> Result<Vec<u8>> {
    // Asked before opening: opening a pipe waits for a writer, and a device may never end.
    if !fs::metadata(path).map_err(Error::io(path))?.is_file() {
        return Err(Error::input(path, "not a regular file"));
    }
    let bytes = fs::read(path).map_err(Error::io(path))?;
    if compressed {
        zstd::decompress(&bytes)
            .map_err(|e| Error::input(path, format!("damaged or truncated: {}", one_line(&e))))
    } else {
        Ok(bytes)
    }
}

/// The mesh in `path`.
pub(super) fn read_mesh(path: &Path) -> Result<MeshFile> {
    match of(path) {
        Some((Format { reader: Reader::Mesh(reader), .. }, compressed)) => {
            reader(path, &read(path, compressed)?)
        }
        Some(_) => Err(Error::input(path, "a scene file, not a mesh")),
        None => Err(unknown(path)),
    }
}

/// The error for a file whose name does not tell its format.
pub(super) fn unknown(path: &Path) -> Error {
    Error::input(path, format!("unknown format; the known ones are {}", extensions()))
}

/// All extensions, for messages.
pub(super) fn extensions() -> String {
    let all: Vec<_> =
        FORMATS.iter().flat_map(|f| f.extensions).map(|e| format!(".{e}, .{e}.zst")).collect();
    all.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_formats() {
        let about = |name| of(Path::new(name)).map(|(f, compressed)| (f.extensions[0], compressed));
        assert_eq!(about("a/b.OBJ"), Some(("obj", false)));
        assert_eq!(about("b.obj.zst"), Some(("obj", true)));
        assert_eq!(about("b.zst"), Some(("obj", true)));
        assert_eq!(about("b.toml"), Some(("toml", false)));
        for unknown in ["b", "b.png", "b.png.zst", "obj", ""] {
            assert_eq!(about(unknown), None);
        }
    }
}
