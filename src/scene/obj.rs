//! Wavefront OBJ: triangles and polygons of vertex positions.

use super::Object;
use super::formats::{Format, MeshFile, Reader};
use super::mesh_builder::MeshPart;
use super::obj_text::{PositionsOnly, find_fault};
use crate::error::one_line;
use crate::{Error, Result};
use glam::Vec3;
use std::collections::HashMap;
use std::path::Path;

/// The catalogue's entry.
pub(super) static FORMAT: Format = Format {
    extensions: &["obj"],
    about: "Wavefront OBJ: positions and polygons (split into fans); all else is ignored",
    reader: Reader::Mesh(read),
};

/// Reads the `text` of `path`. Vertices keep the order in which faces first use them.
fn read(path: &Path, text: &[u8]) -> Result<MeshFile> {
    // One model for the whole file, as `PositionsOnly` leaves no group or material in.
    let options = tobj::LoadOptions { triangulate: true, single_index: true, ..Default::default() };
    let no_materials = |_: &Path| Ok((Vec::new(), HashMap::new()));
    let mut filtered = PositionsOnly::new(text);
    let (models, _) = tobj::load_obj_buf(&mut filtered, &options, no_materials)
        .map_err(|e| fault(path, text, &e.to_string()))?;
    let mut part = MeshPart::default();
    for model in models {
        let first = part.vertices.len() as u32;
        let indices = model.mesh.indices.as_chunks().0;
        part.triangles.extend(indices.iter().map(|t: &[u32; 3]| t.map(|i| first + i)));
        let positions = model.mesh.positions.as_chunks().0;
        part.vertices.extend(positions.iter().map(|&p| Vec3::from_array(p)));
    }
    if part.triangles.is_empty() {
        return Err(Error::input(path, "no triangles"));
    }
    let count = part.triangles.len();
    let dropped = part.drop_non_finite();
    if dropped == count {
        return Err(Error::input(path, format!("none of {count} triangles has finite vertices")));
    }
    part.check_coordinates().map_err(|message| fault(path, text, &message))?;
    let mut warnings = Vec::new();
    if dropped > 0 {
        warnings.push(format!(
            "{}: dropped {dropped} of {count} triangles: a vertex is not finite",
            one_line(&path.display().to_string())
        ));
    }
    let groups = if dropped > 0 { &[][..] } else { &filtered.groups };
    let objects = objects(&part, groups);
    let vertices_in_file = filtered.vertices;
    Ok(MeshFile { part, objects, vertices_in_file, triangles_dropped: dropped, warnings })
}

/// The groups, each beginning with the triangle given, as objects. Those that share vertices become
/// one, together with what lies between them.
fn objects(part: &MeshPart, groups: &[usize]) -> Vec<Object> {
    let count = part.triangles.len();
    let starts = [0].into_iter().chain(groups.iter().copied());
    let ends = groups.iter().copied().chain([count]);
    let mut objects: Vec<Object> = Vec::new();
    for (start, end) in starts.zip(ends).filter(|(start, end)| start < end) {
        let used = part.triangles[start..end].iter().flatten();
        let (low, high) = used.fold((usize::MAX, 0), |(low, high), &i| {
            (low.min(i as usize), high.max(i as usize + 1))
        });
        // Vertices lie in the order of their first use: a group that has none of earlier ones
        // begins where they end.
        let mut object = Object { vertices: low..high, triangles: start..end, moves: false };
        while let Some(last) = objects.pop_if(|last| object.vertices.start < last.vertices.end) {
            let low = last.vertices.start.min(object.vertices.start);
            let high = last.vertices.end.max(object.vertices.end);
            object.vertices = low..high;
            object.triangles.start = last.triangles.start;
        }
        objects.push(object);
    }
    objects
}

/// The error for `path`, with the line if one is at fault.
fn fault(path: &Path, text: &[u8], otherwise: &str) -> Error {
    match find_fault(text) {
        Some((line, message)) => Error::input_line(path, line, message),
        None => Error::input(path, otherwise),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(text: &str) -> Result<MeshFile> {
        read(Path::new("x.obj"), text.as_bytes())
    }

    const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    #[test]
    fn groups_share_vertices_and_polygons_become_fans() {
        let mesh = load(&format!("{CORNERS}g a\nf 1/1 2/2 3/3 4/4\nusemtl m\ng b\nf 4/4 -2/9 -3"));
        let part = mesh.unwrap().part;
        assert_eq!(part.vertices.len(), 4);
        assert_eq!(part.triangles, [[0, 1, 2], [0, 2, 3], [3, 2, 1]]);
    }

    #[test]
    fn groups_with_vertices_of_their_own_are_objects() {
        let three = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
        let text = format!(
            "{three}f 1 2 3\ng a\n{three}f 6 5 4\ng b\no c\n{three}f 7 8 9\nf 7 8 9\ng d\nf 4 8 5 6"
        );
        let object = |v: [usize; 2], t: [usize; 2]| Object {
            vertices: v[0]..v[1],
            triangles: t[0]..t[1],
            moves: false,
        };
        let apart = load(text.split("\ng d").next().unwrap()).unwrap();
        let expected = [object([0, 3], [0, 1]), object([3, 6], [1, 2]), object([6, 9], [2, 4])];
        assert_eq!(apart.objects, expected);
        // The last group shares with the second and the third.
        let shared = load(&text).unwrap();
        assert_eq!(shared.objects, [object([0, 3], [0, 1]), object([3, 9], [1, 6])]);
        assert_eq!(shared.vertices_in_file, 9);
    }

    #[test]
    fn unused_vertices_go_and_weights_divide() {
        let part = load("v 9 9 9\nv 0 0 0 2\nv 2 0 0 2\nv 0 4 0 2\nf 2 3 4").unwrap().part;
        assert_eq!(part.vertices, [Vec3::ZERO, Vec3::X, Vec3::Y * 2.0]);
    }

    #[test]
    fn faces_may_come_before_their_vertices() {
        assert_eq!(load(&format!("f 1 2 3\n{CORNERS}")).unwrap().part.triangles.len(), 1);
    }

    #[test]
    fn non_finite_triangles_are_dropped_with_their_vertices() {
        let text = "v nan 0 0\nv 1e400 0 0\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 3 4\nf 3 4 5\nf 2 4 5";
        let mesh = load(text).unwrap();
        assert_eq!(mesh.part.vertices.len(), 3);
        assert_eq!(mesh.part.triangles, [[0, 1, 2]]);
        assert_eq!(mesh.warnings, ["x.obj: dropped 2 of 3 triangles: a vertex is not finite"]);
    }

    #[test]
    fn degenerate_triangles_stay() {
        assert_eq!(load(&format!("{CORNERS}f 1 1 1")).unwrap().part.triangles, [[0, 0, 0]]);
    }
}
