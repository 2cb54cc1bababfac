//! Sequences of mesh files with one topology: key frames.

use super::formats::{self, MeshFile};
use crate::geometry::Vec3;
use crate::{Error, Result};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Most key frames of a sequence.
pub(super) const MAX_KEYS: usize = 100_000;

/// A file name with a number in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pattern<'a> {
    before: &'a str,
    /// Digits at least, with zeros in front.
    digits: usize,
    after: &'a str,
}

impl<'a> Pattern<'a> {
    /// `%d` stands for the number, `%02d` for one of at least two digits; there is one of these. The
    /// error says what is wrong.
    pub(super) fn parse(name: &'a str) -> std::result::Result<Self, String> {
        let wrong = || format!("with keys it must hold one %d (or %02d ... %09d), not {name:?}");
        let (before, rest) = name.split_once('%').ok_or_else(wrong)?;
        let (width, after) = rest.split_once('d').ok_or_else(wrong)?;
        let digits = match width.as_bytes() {
            [] => 1,
            [b'0', digits @ b'1'..=b'9'] => usize::from(digits - b'0'),
            _ => return Err(wrong()),
        };
        if after.contains('%') {
            return Err(wrong());
        }
        Ok(Self { before, digits, after })
    }

    /// The name with `number`.
    pub(super) fn name(&self, number: usize) -> String {
        let Self { before, digits, after } = self;
        format!("{before}{number:0digits$}{after}")
    }
}

/// Reads the meshes in `paths`, at least one, and gives the first with the vertices of all.
///
/// # Errors
/// Naming the first file that cannot be read, drops triangles, or has other vertices or triangles
/// than the first one.
pub(super) fn read(paths: &[PathBuf]) -> Result<(MeshFile, Vec<Vec<Vec3>>)> {
    let (first_path, rest) = paths.split_first().expect("a sequence has a first key");
    let first = formats::read_mesh(first_path)?;
    check_whole(first_path, &first)?;
    // Of each, only the vertices stay; as many texts are in memory at a time as there are threads.
    let vertices = |path: &PathBuf| {
        let key = formats::read_mesh(path)?;
        check_whole(path, &key)?;
        match difference(&first, &key) {
            None => Ok(key.part.vertices),
            Some(difference) => {
                let first = first_path.file_name().unwrap_or_default().to_string_lossy();
                let message = format!("{difference} in {first:?}, the first key of its sequence");
                Err(Error::input(path, message))
            }
        }
    };
    let others: Vec<Result<Vec<Vec3>>> = rest.par_iter().map(vertices).collect();
    let mut keys = vec![first.part.vertices.clone()];
    for key in others {
        keys.push(key?);
    }
    Ok((first, keys))
}

/// Without triangles that were dropped: other keys could lack others.
fn check_whole(path: &Path, key: &MeshFile) -> Result<()> {
    match key.triangles_dropped {
        0 => Ok(()),
        dropped => {
            let message = format!("{dropped} triangles have a vertex that is not finite, in a key");
            Err(Error::input(path, message))
        }
    }
}

/// In what `key` is not like `first`: the beginning of a sentence.
fn difference(first: &MeshFile, key: &MeshFile) -> Option<String> {
    let (ours, theirs) = (&key.part, &first.part);
    // Vertices are numbered by their first use, so that equal triangles have equal corners.
    let counts = [
        ("vertices", key.vertices_in_file, first.vertices_in_file),
        ("triangles", ours.triangles.len(), theirs.triangles.len()),
        ("vertices in use", ours.vertices.len(), theirs.vertices.len()),
    ];
    if let Some((what, ours, theirs)) = counts.iter().find(|(_, ours, theirs)| ours != theirs) {
        return Some(format!("{ours} {what}, not {theirs} as"));
    }
    let mut pairs = ours.triangles.iter().zip(&theirs.triangles);
    let other = pairs.position(|(ours, theirs)| ours != theirs)?;
    Some(format!("triangle {} does not join the same vertices as", other + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_number_files() {
        let name = |pattern, number| Pattern::parse(pattern).map(|p| p.name(number));
        assert_eq!(name("a%d.obj", 12).unwrap(), "a12.obj");
        assert_eq!(name("x/a_%02d.obj.zst", 7).unwrap(), "x/a_07.obj.zst");
        assert_eq!(name("%04d.obj", 12345).unwrap(), "12345.obj");
        for bad in ["a.obj", "a%.obj", "a%2d.obj", "a%0d", "a%00d", "a%d%d", "%s.d", "a%012d", ""] {
            assert!(name(bad, 0).unwrap_err().contains("%02d"), "{bad:?}");
        }
    }
}
