//! Writes the triangles of a scene for other programs.

use super::{Scene, formats, zstd};
use crate::geometry::TriangleMesh;
use crate::output::write_atomically;
use crate::{Error, Result};
use std::ffi::OsStr;
use std::io::{self, Write};
use std::path::Path;

/// Writes the mesh of `scene` to `path`, an OBJ file, compressed if the name ends in `.zst`. Each
/// coordinate has as many digits as it takes to read the same `f32` back.
pub fn export(scene: &Scene, path: impl AsRef<Path>) -> Result<()> {
    let path = path.as_ref();
    match formats::of(path) {
        Some((format, compressed)) if format.extensions.contains(&"obj") => {
            write_atomically(path, |writer| {
                if compressed {
                    // In memory, as the encoder would panic where a writer fails.
                    let mut text = Vec::new();
                    write_obj(&scene.name, &scene.mesh, &mut text)?;
                    writer.write_all(&zstd::compress(&text))
                } else {
                    write_obj(&scene.name, &scene.mesh, writer)
                }
            })
        }
        _ => {
            let name = path.file_name().unwrap_or(OsStr::new("")).to_string_lossy();
            Err(Error::Usage(format!("cannot export {name:?}: it must end in .obj or .obj.zst")))
        }
    }
}

fn write_obj(name: &str, mesh: &TriangleMesh, out: &mut impl Write) -> io::Result<()> {
    let (vertices, triangles) = (mesh.vertices(), mesh.triangles());
    writeln!(out, "# {name}: {} vertices, {} triangles", vertices.len(), triangles.len())?;
    vertices.iter().try_for_each(|v| writeln!(out, "v {} {} {}", v.x, v.y, v.z))?;
    triangles.iter().try_for_each(|t| {
        let [a, b, c] = t.map(|i| u64::from(i) + 1);
        writeln!(out, "f {a} {b} {c}")
    })
}
