//! From what a user names to a checked scene.

use super::formats::{self, Format, MeshFile, Reader};
use super::generate::{self, GENERATORS, GeneratorEntry};
use super::mesh_builder::MeshBuilder;
use super::{Defaults, Scene, suggest};
use crate::{Error, Result};
use glam::DAffine3;
use std::path::Path;

/// Loads a scene: a file in one of the [`FORMATS`](super::FORMATS), or a generator by its bare name
/// (with seed 0). A mesh file alone gets a camera and a light that suit its bounds.
///
/// Repairs and omissions are in [`Scene::warnings`]; an error is one line with file, line and key.
pub fn load(reference: impl AsRef<Path>) -> Result<Scene> {
    let path = reference.as_ref();
    let scene = if let Some(generator) = path.to_str().and_then(generate::find) {
        of_generator(generator)
    } else {
        match formats::of(path) {
            Some((Format { reader: Reader::Scene(reader), .. }, compressed)) => {
                reader(path, &formats::read(path, compressed)?)?
            }
            Some((Format { reader: Reader::Mesh(reader), .. }, compressed)) => {
                of_mesh(path, reader(path, &formats::read(path, compressed)?)?)?
            }
            None if path.exists() => return Err(formats::unknown(path)),
            None => return Err(no_such_scene(path)),
        }
    };
    scene.check().map_err(|fault| Error::input(path, fault))?;
    Ok(scene)
}

fn of_generator(generator: &GeneratorEntry) -> Scene {
    let made = (generator.generate)(0);
    Scene {
        name: generator.name.into(),
        mesh: made.mesh.into(),
        camera: made.camera,
        lights: made.lights,
        defaults: Defaults { ao_radius: made.ao_radius, size: Defaults::SIZE },
        motion: made.motion.map(Into::into),
        warnings: Vec::new(),
    }
}

fn of_mesh(path: &Path, file: MeshFile) -> Result<Scene> {
    let mut builder = MeshBuilder::default();
    builder.append(file.part, &DAffine3::IDENTITY).map_err(|e| Error::input(path, e))?;
    let mesh = builder.finish();
    let bounds = mesh.bounds();
    Ok(Scene {
        name: stem(path),
        camera: suggest::camera(&bounds),
        lights: vec![suggest::light(&bounds)],
        defaults: Defaults { ao_radius: suggest::ao_radius(&bounds), size: Defaults::SIZE },
        mesh: mesh.into(),
        motion: None,
        warnings: file.warnings,
    })
}

/// The file name up to its first dot, in letters that any file or layer name takes.
pub(super) fn stem(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let stem = name.split('.').next().unwrap_or_default();
    let usable = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
    let stem: String = stem.chars().take(64).map(usable).collect();
    if stem.is_empty() { "scene".into() } else { stem }
}

fn no_such_scene(path: &Path) -> Error {
    let generators: Vec<_> = GENERATORS.iter().map(|entry| entry.name).collect();
    Error::Usage(format!(
        "no scene {:?}: give a file ({}) or a generator ({})",
        path.to_string_lossy(),
        formats::extensions(),
        generators.join(", ")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stems_are_usable_names() {
        assert_eq!(stem(Path::new("a/b c.v2.obj.zst")), "b_c");
        assert_eq!(stem(Path::new(".obj")), "scene");
    }
}
