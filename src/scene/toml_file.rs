//! Scene files: TOML that puts geometry, camera and lights together. `scenes/README.md` is their
//! reference; this is all they can hold:
//!
//! ```toml
//! name = "hall"                        # default: the file's name
//! size = [1280, 720]                   # of the image, in pixels
//! mesh_folders = ["meshes"]            # see below
//! origin = "where to get the meshes"   # told when one is absent
//!
//! [camera]                             # default: the generator's, or one that shows all
//! eye = [0, 1, 5]
//! look_at = [0, 1, 0]
//! up = [0, 1, 0]
//! fov_degrees = 45                     # vertical
//!
//! [ambient_occlusion]
//! radius = 2.5                         # default: the generator's, or a tenth of the diagonal
//!
//! [animation]                          # of what moves below
//! frames = 20                          # default: as many as the longest sequence has keys, else the
//!                                      # generator's, else 20
//!
//! [[geometry]]                         # at least one
//! file = "hall.obj.zst"                # or: generator = "atrium", and perhaps seed = 0
//! # file = "crowd_%02d.obj.zst"        # or: a sequence of key frames, from crowd_00 to crowd_09
//! # keys = [0, 9]
//! scale = 1                            # or [x, y, z]; first
//! rotate_degrees = [0, 0, 0]           # about x, then y, then z; second
//! translate = [0, 0, 0]                # last
//! # matrix = [ ... ]                   # instead: 16 numbers row by row, last row 0, 0, 0, 1
//!
//! [[geometry.key]]                     # none, or at least two: a transform before that of the entry
//! time = 0                             # from 0 at the first frame to 1 at the last, increasing
//! scale = 1                            # these as above, each number going straight to the next key's
//! rotate_degrees = [0, 0, 0]
//! translate = [0, 0, 0]
//!
//! [[light]]                            # none at all: the generator's, or a quad; `light = []`: dark
//! type = "quad"                        # corner, edge_u, edge_v, radiance
//! corner = [-1, 3, -1]                 # disk: center, normal, radius, radiance
//! edge_u = [2, 0, 0]                   # sphere: center, radius, radiance
//! edge_v = [0, 0, 2]                   # directional: direction, angular_diameter_degrees, irradiance
//! radiance = 10                        # point: position, intensity
//! name = "lamp"                        # default: light1, light2 ...
//! ```
//!
//! A relative `file` is looked for in the folder that `SATO_SCENES` names, the scene file's own, and
//! its `mesh_folders`, in this order.

use super::formats::{self, Format, Reader};
use super::generate::Generated;
use super::load::stem;
use super::mesh_builder::{MeshBuilder, MeshPart};
use super::motion_builder::{LocalMotion, MotionBuilder};
use super::toml_entries::{LightEntry, SceneEntry};
use super::toml_placement::{Source, placement, source, transform_keys};
use super::toml_spans::{key_at, line_at, line_of};
use super::{
    Camera, Defaults, InvalidValue, Light, Object, Scene, check, sequence, suggest, transform,
};
use crate::error::one_line;
use crate::geometry::Aabb;
use crate::{Error, Result};
use glam::DAffine3;
use std::env;
use std::path::{Path, PathBuf};

/// The catalogue's entry.
pub(super) static FORMAT: Format = Format {
    extensions: &["toml"],
    about: "scene file: meshes and generators with a camera and lights",
    reader: Reader::Scene(read),
};

fn read(path: &Path, bytes: &[u8]) -> Result<Scene> {
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let line = 1 + bytes[..e.valid_up_to()].iter().filter(|&&b| b == b'\n').count();
        Error::input_line(path, line, "not UTF-8 text")
    })?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let entry: SceneEntry = toml::from_str(text).map_err(|e| toml_error(path, text, &e))?;
    let folders = mesh_folders(path, &entry.mesh_folders, named_folder());
    SceneFile { path, text, folders, entry }.scene()
}

/// Where relative mesh files may be.
fn mesh_folders(path: &Path, listed: &[String], named: Option<PathBuf>) -> Vec<PathBuf> {
    let own = path.parent().unwrap_or(Path::new(""));
    let listed = listed.iter().map(|folder| own.join(folder));
    named.into_iter().chain([own.to_path_buf()]).chain(listed).collect()
}

/// The environment variable that names a folder of meshes.
const SATO_SCENES: &str = "SATO_SCENES";

/// Most frames of a scene.
const MAX_FRAMES: usize = 100_000;

/// The folder that it names, if any.
fn named_folder() -> Option<PathBuf> {
    env::var_os(SATO_SCENES).filter(|folder| !folder.is_empty()).map(PathBuf::from)
}

fn toml_error(path: &Path, text: &str, error: &toml::de::Error) -> Error {
    let message = one_line(error.message());
    match error.span() {
        Some(span) => {
            let key = key_at(text, &span).map(|key| one_line(&key) + ": ").unwrap_or_default();
            Error::input_line(path, line_at(text, span.start), key + &message)
        }
        None => Error::input(path, message),
    }
}

/// A scene file that has been read but not yet understood.
struct SceneFile<'a> {
    path: &'a Path,
    text: &'a str,
    folders: Vec<PathBuf>,
    entry: SceneEntry,
}

impl SceneFile<'_> {
    fn scene(&self) -> Result<Scene> {
        let name = self.entry.name.clone().unwrap_or_else(|| stem(self.path));
        check::layer_name("name", &name).map_err(|f| self.fault(f))?;
        if self.entry.geometry.is_empty() {
            return Err(self.fault(InvalidValue::new("geometry", "there must be at least one")));
        }
        let size = self.size().map_err(|f| self.fault(f))?;
        // Everything that needs no mesh is checked first: loading one may take seconds.
        let camera = self.entry.camera.as_ref().map(Camera::from);
        if let Some(camera) = &camera {
            camera.check().map_err(|f| self.fault(f.within("camera")))?;
        }
        let entries = self.entry.light.as_deref();
        entries.unwrap_or_default().iter().enumerate().try_for_each(|(i, light)| {
            let checked = light.shape().and_then(|shape| shape.check());
            checked.map_err(|f| self.fault(f.within(&format!("light[{i}]"))))
        })?;

        let frames = self.frames().map_err(|f| self.fault(f))?;

        let mut builder = MeshBuilder::default();
        let mut motion = MotionBuilder::default();
        let mut warnings = Vec::new();
        let mut suggested = None;
        for (i, geometry) in self.entry.geometry.iter().enumerate() {
            let table = format!("geometry[{i}]");
            let placed = placement(geometry).map_err(|f| self.fault(f.within(&table)))?;
            let keys = transform_keys(geometry).map_err(|f| self.fault(f.within(&table)))?;
            let (part, objects, local) =
                match source(geometry).map_err(|f| self.fault(f.within(&table)))? {
                    Source::File(file) => {
                        let mesh = formats::read_mesh(&self.find_mesh(file, &table)?)?;
                        warnings.extend(mesh.warnings);
                        (mesh.part, mesh.objects, LocalMotion::Still)
                    }
                    Source::Sequence(names) => {
                        let paths: Result<Vec<_>> =
                            names.iter().map(|name| self.find_mesh(name, &table)).collect();
                        let (mesh, keys) = sequence::read(&paths?)?;
                        (mesh.part, mesh.objects, LocalMotion::Keys(keys))
                    }
                    Source::Made(mut made) => {
                        suggested.get_or_insert_with(|| Suggested::of(&made, &placed));
                        let part = MeshPart {
                            vertices: made.mesh.vertices().to_vec(),
                            triangles: made.mesh.triangles().to_vec(),
                        };
                        let whole = Object {
                            vertices: 0..part.vertices.len(),
                            triangles: 0..part.triangles.len(),
                            moves: false,
                        };
                        let local = made.motion.take().map_or(LocalMotion::Still, LocalMotion::Own);
                        (part, vec![whole], local)
                    }
                };
            motion
                .append(&part, objects, local, keys, placed)
                .and_then(|first| builder.append(part, &first))
                .map_err(|message| self.fault(InvalidValue::new(&table, message)))?;
        }
        let motion = motion.finish(frames);
        if motion.is_none() && frames.is_some() {
            let fault = InvalidValue::new("frames", "is given, but nothing in the scene moves");
            return Err(self.fault(fault.within("animation")));
        }
        let mesh = builder.finish();
        let bounds = mesh.bounds();
        let suggested = suggested.unwrap_or_else(|| Suggested::from_bounds(&bounds));
        let radius = self.entry.ambient_occlusion.as_ref().map(|ao| ao.radius as f32);
        let scene = Scene {
            name,
            mesh: mesh.into(),
            camera: camera.unwrap_or(suggested.camera),
            lights: match entries {
                Some(entries) => self.lights(entries, &bounds)?,
                None => suggested.lights,
            },
            defaults: Defaults { ao_radius: radius.unwrap_or(suggested.ao_radius), size },
            motion: motion.map(Into::into),
            warnings,
        };
        scene.check().map_err(|f| self.fault(f))?;
        Ok(scene)
    }

    fn size(&self) -> std::result::Result<[u32; 2], InvalidValue> {
        let Some(size) = self.entry.size else { return Ok(Defaults::SIZE) };
        if size
            .0
            .iter()
            .any(|n| n.fract() != 0.0 || !(1.0..=f64::from(Defaults::MAX_SIDE)).contains(n))
        {
            let (max, [width, height]) = (Defaults::MAX_SIDE, size.0);
            let message =
                format!("must be 1 to {max} whole pixels each way, not {width} x {height}");
            return Err(InvalidValue::new("size", message));
        }
        Ok(size.0.map(|n| n as u32))
    }

    fn frames(&self) -> std::result::Result<Option<usize>, InvalidValue> {
        let Some(animation) = &self.entry.animation else { return Ok(None) };
        let frames = animation.frames;
        if frames.fract() == 0.0 && (1.0..=MAX_FRAMES as f64).contains(&frames) {
            return Ok(Some(frames as usize));
        }
        let message = format!("must be a whole number from 1 to {MAX_FRAMES}, not {frames}");
        Err(InvalidValue::new("animation.frames", message))
    }

    fn lights(&self, entries: &[LightEntry], bounds: &Aabb) -> Result<Vec<Light>> {
        let light = |(i, entry): (usize, &LightEntry)| {
            let shape = entry.shape().map_err(|f| self.fault(f.within(&format!("light[{i}]"))))?;
            let strength = entry.strength().unwrap_or_else(|| suggest::strength(&shape, bounds));
            let name = entry.name.clone().unwrap_or_else(|| format!("light{}", i + 1));
            Ok(Light { name, shape, strength })
        };
        entries.iter().enumerate().map(light).collect()
    }

    /// Where the mesh `file` of `table` is.
    fn find_mesh(&self, file: &str, table: &str) -> Result<PathBuf> {
        let candidates = self.folders.iter().map(|folder| folder.join(file));
        if let Some(found) = candidates.into_iter().find(|candidate| candidate.exists()) {
            return Ok(found);
        }
        let file = Path::new(file);
        let looked_in = if file.is_absolute() {
            file.parent().into_iter().map(Path::to_path_buf).collect()
        } else {
            let shown = |f: &PathBuf| if f.as_os_str().is_empty() { ".".into() } else { f.clone() };
            self.folders.iter().map(shown).collect()
        };
        let mut hint = match named_folder() {
            Some(_) => format!("{SATO_SCENES} names the first of them"),
            None => format!("{SATO_SCENES} may name another folder"),
        };
        if let Some(origin) = &self.entry.origin {
            hint += &format!("; get it from: {}", one_line(origin.trim()));
        }
        Err(Error::MissingMesh {
            scene: self.path.to_path_buf(),
            line: line_of(self.text, &format!("{table}.file")),
            mesh: file.to_path_buf(),
            looked_in,
            hint,
        })
    }

    /// The error for what is wrong with a value of this file.
    fn fault(&self, fault: InvalidValue) -> Error {
        let line = line_of(self.text, &fault.key);
        Error::Input { path: self.path.to_path_buf(), line, message: one_line(&fault.to_string()) }
    }
}

/// What stands in for what the file does not say.
struct Suggested {
    camera: Camera,
    lights: Vec<Light>,
    ao_radius: f32,
}

impl Suggested {
    fn of(made: &Generated, placed: &DAffine3) -> Self {
        Self {
            camera: transform::camera(&made.camera, placed),
            lights: made.lights.iter().map(|light| transform::light(light, placed)).collect(),
            ao_radius: (f64::from(made.ao_radius) * transform::mean_scale(placed)) as f32,
        }
    }

    fn from_bounds(bounds: &Aabb) -> Self {
        Self {
            camera: suggest::camera(bounds),
            lights: vec![suggest::light(bounds)],
            ao_radius: suggest::ao_radius(bounds),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_named_folder_comes_first_and_the_listed_ones_last() {
        let listed = ["meshes".to_owned(), "/far".to_owned()];
        let folders = |path, named: Option<&str>| {
            mesh_folders(Path::new(path), &listed, named.map(PathBuf::from))
        };
        let expected = ["/named", "a", "a/meshes", "/far"].map(PathBuf::from);
        assert_eq!(folders("a/b.toml", Some("/named")), expected);
        assert_eq!(folders("b.toml", None), ["", "meshes", "/far"].map(PathBuf::from));
    }
}
