//! References on disk: a file for each, found by all that determines it, trusted only if whole.

use crate::Result;
use crate::output::write_atomically;
use crate::render::{Film, RenderSettings};
use crate::scene::Scene;
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"SATOREF1";
const DIGEST: usize = 32;

/// What is kept of a reference.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Kept {
    pub(super) size: [u32; 2],
    /// One value for each pixel, row by row, of each channel.
    pub(super) planes: Vec<Vec<f32>>,
    /// Which pixels see a surface.
    pub(super) pixels: Vec<usize>,
    /// Mean variance of the values.
    pub(super) variance: f64,
    /// What rendering it took.
    pub(super) ms: f64,
}

/// All that determines a reference, in words.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Key(String);

impl Key {
    /// Of `parts` images by `settings`. `probe` is an image of few samples with the same settings:
    /// it changes when the code does that draws samples, makes rays, answers them or sums them up,
    /// which no version number that somebody must remember would say as well.
    pub(super) fn new(scene: &Scene, settings: &RenderSettings, parts: u32, probe: &Film) -> Self {
        let mut mesh = Sha256::new();
        for vertex in scene.mesh.vertices() {
            vertex.to_array().iter().for_each(|v| mesh.update(v.to_le_bytes()));
        }
        mesh.update([0xff; 16]);
        for triangle in scene.mesh.triangles() {
            triangle.iter().for_each(|v| mesh.update(v.to_le_bytes()));
        }
        let mut picture = Sha256::new();
        for channel in probe.layers().iter().flat_map(|layer| &layer.channels) {
            channel.values.iter().for_each(|v| picture.update(v.to_le_bytes()));
        }
        let [mesh, picture] = [mesh, picture].map(|hash| hex(&hash.finalize()));
        let RenderSettings { size, spp, camera_samples, seed, ao_radius, passes, .. } = settings;
        let (sampler, light_sampling) = (settings.sampler.name, settings.light_sampling.name());
        Self(format!(
            "{parts} parts {size:?} {spp} {camera_samples} {seed} {ao_radius:?} {passes:?} {sampler} \
             {light_sampling}\nmesh {mesh}\n{:?}\n{:?}\nprobe {picture}\n",
            scene.camera, scene.lights
        ))
    }

    /// The file of this key in `folder`.
    pub(super) fn path(&self, folder: &Path) -> PathBuf {
        folder.join(format!("{}.reference", &hex(&Sha256::digest(self.0.as_bytes()))[..32]))
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// What lies in the file: nothing, a reference, or something else, and what is wrong with it.
pub(super) enum Found {
    Nothing,
    Whole(Kept),
    Damaged(String),
}

/// Looks for the reference of `key`.
pub(super) fn read(path: &Path, key: &Key) -> Found {
    match fs::read(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Found::Nothing,
        Err(error) => Found::Damaged(error.to_string()),
        Ok(bytes) => {
            decode(&bytes, key).map_or_else(|why| Found::Damaged(why.into()), Found::Whole)
        }
    }
}

/// Writes the reference of `key`.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io) naming the file.
pub(super) fn write(path: &Path, key: &Key, kept: &Kept) -> Result<()> {
    write_atomically(path, |out| out.write_all(&encode(key, kept)))
}

/// Magic number, key, sizes, figures, which pixels see a surface, values; then a digest of all that.
fn encode(key: &Key, kept: &Kept) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    let text = key.0.as_bytes();
    let [width, height] = kept.size;
    for number in [text.len() as u64, width.into(), height.into(), kept.planes.len() as u64] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend(text);
    bytes.extend(kept.variance.to_le_bytes());
    bytes.extend(kept.ms.to_le_bytes());
    let mut seen = vec![0; width as usize * height as usize];
    kept.pixels.iter().for_each(|&pixel| seen[pixel] = 1);
    bytes.extend(seen);
    kept.planes.iter().flatten().for_each(|v| bytes.extend(v.to_le_bytes()));
    let digest = Sha256::digest(&bytes);
    bytes.extend(digest);
    bytes
}

fn decode(bytes: &[u8], key: &Key) -> std::result::Result<Kept, &'static str> {
    let cut = "it is cut short";
    let (bytes, digest) = bytes.split_last_chunk::<DIGEST>().ok_or(cut)?;
    let mut rest = bytes.strip_prefix(MAGIC).ok_or("it is no reference")?;
    if Sha256::digest(bytes)[..] != digest[..] {
        return Err("its digest does not fit");
    }
    let mut take = |count: u64| -> std::result::Result<&[u8], &'static str> {
        let count = usize::try_from(count).map_err(|_| cut)?;
        let (taken, left) = rest.split_at_checked(count).ok_or(cut)?;
        rest = left;
        Ok(taken)
    };
    let mut word = || -> std::result::Result<[u8; 8], &'static str> {
        Ok(take(8)?.try_into().expect("eight bytes"))
    };
    let [length, width, height, channels] =
        [word()?, word()?, word()?, word()?].map(u64::from_le_bytes);
    if take(length)? != key.0.as_bytes() {
        return Err("it is of something else");
    }
    let [variance, ms] = [take(8)?, take(8)?]
        .map(|bytes| f64::from_le_bytes(bytes.try_into().expect("eight bytes")));
    let side = |length: u64| u32::try_from(length).map_err(|_| cut);
    let size = [side(width)?, side(height)?];
    let count = width * height;
    let pixels = take(count)?.iter().enumerate().filter(|(_, seen)| **seen == 1).map(|(p, _)| p);
    let pixels = pixels.collect();
    let mut planes = Vec::new();
    for _ in 0..channels {
        let plane = take(4 * count)?.chunks_exact(4);
        let value = |bytes: &[u8]| f32::from_le_bytes(bytes.try_into().expect("four bytes"));
        planes.push(plane.map(value).collect());
    }
    if take(1).is_ok() {
        return Err("something follows its end");
    }
    Ok(Kept { size, planes, pixels, variance, ms })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept() -> Kept {
        let planes = vec![vec![0.5, 0.0, f32::MIN_POSITIVE, 1.0, -0.0, 7.25]; 3];
        Kept { size: [3, 2], planes, pixels: vec![0, 3, 5], variance: 1.5e-9, ms: 12.5 }
    }

    #[test]
    fn what_was_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let key = Key("a scene".into());
        let path = key.path(folder.path());
        assert!(matches!(read(&path, &key), Found::Nothing));
        write(&path, &key, &kept()).unwrap();
        assert!(matches!(read(&path, &key), Found::Whole(found) if found == kept()));
        // Another key has another file; put in its place, it is not believed.
        let other = Key("another".into());
        assert_ne!(other.path(folder.path()), path);
        assert!(matches!(read(&path, &other), Found::Damaged(why) if why.contains("else")));
    }

    #[test]
    fn every_damaged_byte_and_every_missing_end_is_noticed() {
        let key = Key("a scene".into());
        let whole = encode(&key, &kept());
        assert!(decode(&whole, &key).is_ok());
        for place in 0..whole.len() {
            let mut damaged = whole.clone();
            damaged[place] ^= 0x10;
            assert!(decode(&damaged, &key).is_err(), "byte {place}");
            assert!(decode(&whole[..place], &key).is_err(), "length {place}");
        }
        assert!(decode(&[whole, vec![0]].concat(), &key).is_err());
    }
}
