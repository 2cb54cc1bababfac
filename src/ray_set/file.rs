//! Ray files: a line of text, a JSON header, then the rays as little-endian `f32`.
//!
//! ```text
//! sato rays 1\n
//! {"scene": "...", ...}\n        one line
//! origin.xyz t_min direction.xyz t_max   32 bytes a ray, class after class
//! ```

use super::RaySet;
use crate::error::one_line;
use crate::geometry::Vec3;
use crate::output::write_atomically;
use crate::ray::Ray;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::io::{BufRead, BufReader, Read, Seek, Write};
use std::path::Path;

const MAGIC: &str = "sato rays 1";
const RAY_BYTES: usize = 32;

/// What a ray file says about its rays.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RayFileHeader {
    scene: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    frame: Option<usize>,
    about: String,
    /// In the order of their rays.
    classes: Vec<RayFileClass>,
}

/// A class of rays in a file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RayFileClass {
    name: String,
    /// Rays in each batch.
    batch_rays: Vec<usize>,
}

/// Recorded rays with what is known about them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RayFile {
    /// The scene that the rays belong to, as it was given on the command line.
    pub scene: String,
    /// The frame of a moving scene that they belong to, counted from 0, if one was asked for.
    pub frame: Option<usize>,
    /// What these rays are, in a line.
    pub about: String,
    /// The rays of each class.
    pub classes: Vec<(String, RaySet)>,
}

impl RayFile {
    /// Writes the file.
    ///
    /// # Errors
    /// [`Error::Io`] naming the file.
    pub fn write(&self, path: &Path) -> Result<()> {
        let header = RayFileHeader {
            scene: self.scene.clone(),
            frame: self.frame,
            about: self.about.clone(),
            classes: self
                .classes
                .iter()
                .map(|(name, set)| RayFileClass {
                    name: name.clone(),
                    batch_rays: set.batches().map(|b| b.rays.len()).collect(),
                })
                .collect(),
        };
        let header = serde_json::to_string(&header).expect("strings and numbers serialise");
        write_atomically(path, |out| {
            writeln!(out, "{MAGIC}\n{header}")?;
            for ray in self.classes.iter().flat_map(|(_, set)| set.rays()) {
                let [o, d] = [ray.origin, ray.direction];
                for value in [o.x, o.y, o.z, ray.t_min, d.x, d.y, d.z, ray.t_max] {
                    out.write_all(&value.to_le_bytes())?;
                }
            }
            Ok(())
        })
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Input`] naming the file, also if it is cut short or too long.
    pub fn read(path: &Path) -> Result<Self> {
        let file = std::fs::File::open(path).map_err(Error::io(path))?;
        let length = file.metadata().map_err(Error::io(path))?.len();
        let mut input = BufReader::new(file);
        let line = |input: &mut BufReader<_>| -> Result<String> {
            let mut bytes = Vec::new();
            // No header is larger than its file; a file without a line end is not ours.
            Read::take(input, length).read_until(b'\n', &mut bytes).map_err(Error::io(path))?;
            String::from_utf8(bytes).map_err(|_| Error::input(path, "not a ray file"))
        };
        if line(&mut input)?.trim_end() != MAGIC {
            return Err(Error::input(path, format!("not a ray file ('{MAGIC}' expected)")));
        }
        let header: RayFileHeader = serde_json::from_str(&line(&mut input)?).map_err(|e| {
            Error::input_line(path, 2, format!("header: {}", one_line(&e.to_string())))
        })?;
        let sizes = header.classes.iter().flat_map(|c| &c.batch_rays);
        let expected = sizes.fold(0u64, |sum, &n| sum.saturating_add(n as u64));
        let rest = length - input.stream_position().map_err(Error::io(path))?;
        if expected.checked_mul(RAY_BYTES as u64) != Some(rest) {
            return Err(Error::input(
                path,
                format!("{expected} rays expected, {rest} bytes of rays found"),
            ));
        }
        let mut classes = Vec::new();
        for class in header.classes {
            let mut set = RaySet::default();
            for count in class.batch_rays {
                let mut bytes = vec![0; count * RAY_BYTES];
                input.read_exact(&mut bytes).map_err(Error::io(path))?;
                let rays: Vec<Ray> = bytes.chunks_exact(RAY_BYTES).map(decode).collect();
                set.push_batch(&rays);
            }
            classes.push((class.name, set));
        }
        Ok(Self { scene: header.scene, frame: header.frame, about: header.about, classes })
    }
}

fn decode(bytes: &[u8]) -> Ray {
    let value = |i: usize| {
        f32::from_le_bytes(bytes[4 * i..4 * i + 4].try_into().expect("four bytes of 32"))
    };
    Ray {
        origin: Vec3::new(value(0), value(1), value(2)),
        t_min: value(3),
        direction: Vec3::new(value(4), value(5), value(6)),
        t_max: value(7),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    #[test]
    fn what_is_written_is_read_back_to_the_bit() {
        let mut random = Random::new(22);
        let mut set = RaySet::default();
        for count in [3, 100] {
            set.push_batch(&(0..count).map(|_| random.ray()).collect::<Vec<_>>());
        }
        let file = RayFile {
            scene: "scenes/a \"b\".toml".into(),
            frame: Some(3),
            about: "a test".into(),
            classes: vec![("ao".into(), set), ("shadow".into(), RaySet::default())],
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.rays");
        file.write(&path).unwrap();
        assert_eq!(RayFile::read(&path).unwrap(), file);

        let bytes = std::fs::read(&path).unwrap();
        for cut in [0, 3, 14, 40, bytes.len() - 1] {
            std::fs::write(&path, &bytes[..cut]).unwrap();
            let error = RayFile::read(&path).unwrap_err().to_string();
            assert!(error.contains("x.rays") && !error.contains('\n'), "{error}");
        }
    }

    /// Found by fuzzing: an error quoted a key of the header as it was.
    #[test]
    fn errors_quote_no_control_characters() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.rays");
        std::fs::write(&path, "sato rays 1\n{\"ab\u{7f}ut\": 1}\n").unwrap();
        let error = RayFile::read(&path).unwrap_err().to_string();
        assert!(error.contains("ab\\u{7f}ut") && !error.chars().any(char::is_control), "{error}");
    }
}
