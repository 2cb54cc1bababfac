//! Meshes and rays that several cases share.

use super::Random;
use crate::geometry::{Triangle, TriangleMesh, Vec3};
use crate::ray::Ray;
use std::collections::HashMap;
use std::f32::consts::TAU;

/// A closed sphere of radius 1: an icosahedron, its triangles split in four `levels` times.
pub(super) fn icosphere(levels: u32) -> TriangleMesh {
    let g = 0.5 * (1.0 + 5f32.sqrt());
    let mut vertices: Vec<Vec3> = Vec::new();
    for (a, b) in [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)] {
        vertices.push(Vec3::new(a, b, 0.0));
    }
    for (a, b) in [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)] {
        vertices.push(Vec3::new(0.0, a, b));
    }
    for (a, b) in [(g, -1.0), (g, 1.0), (-g, -1.0), (-g, 1.0)] {
        vertices.push(Vec3::new(a, 0.0, b));
    }
    vertices.iter_mut().for_each(|v| *v = v.normalize());
    let mut triangles: Vec<[u32; 3]> = [
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ]
    .to_vec();
    for _ in 0..levels {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                vertices.push((vertices[a as usize] + vertices[b as usize]).normalize());
                vertices.len() as u32 - 1
            })
        };
        let split = |[a, b, c]: [u32; 3]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        triangles = triangles.into_iter().flat_map(split).collect();
    }
    TriangleMesh::new(vertices, triangles)
}

/// A closed box around the origin with these half-sizes; each face has `cells` by `cells` squares.
/// Faces share no vertex, but equal ones.
pub(super) fn tessellated_box(half: Vec3, cells: u32) -> TriangleMesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for axis in 0..3 {
        for side in [-1.0f32, 1.0] {
            let first = vertices.len() as u32;
            for i in 0..=cells {
                for j in 0..=cells {
                    // The same bits on both faces at an edge.
                    let at = |k: u32| (2.0 * k as f32 - cells as f32) / cells as f32;
                    let mut p = Vec3::ZERO;
                    p[axis] = side;
                    p[(axis + 1) % 3] = at(i);
                    p[(axis + 2) % 3] = at(j);
                    vertices.push(p * half);
                }
            }
            for i in 0..cells {
                for j in 0..cells {
                    let a = first + i * (cells + 1) + j;
                    let (b, c, d) = (a + 1, a + cells + 2, a + cells + 1);
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
    }
    TriangleMesh::new(vertices, triangles)
}

/// A closed torus around the y axis: the tube of radius `tube` around a circle of radius 1.
pub(super) fn torus(tube: f32, around: u32, along: u32) -> TriangleMesh {
    let mut vertices = Vec::new();
    for i in 0..along {
        let (s, c) = (TAU * i as f32 / along as f32).sin_cos();
        for j in 0..around {
            let (y, x) = (TAU * j as f32 / around as f32).sin_cos();
            let r = 1.0 + tube * x;
            vertices.push(Vec3::new(r * c, tube * y, r * s));
        }
    }
    let at = |i: u32, j: u32| i % along * around + j % around;
    let mut triangles = Vec::new();
    for i in 0..along {
        for j in 0..around {
            let [a, b] = [at(i, j), at(i, j + 1)];
            let [c, d] = [at(i + 1, j + 1), at(i + 1, j)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    TriangleMesh::new(vertices, triangles)
}

/// `count` triangles within about `[-1, 1]` on each axis, of two sizes, now and then degenerate or
/// the last one again.
pub(super) fn soup(random: &mut Random, count: usize) -> TriangleMesh {
    let mut triangles: Vec<Triangle> = Vec::new();
    while triangles.len() < count {
        let a = random.point();
        let size = if random.below(16) == 0 { 1.0 } else { 0.1 };
        let (b, c) = (a + random.point() * size, a + random.point() * size);
        triangles.push(match random.below(32) {
            0 => Triangle([a, a, b]),
            1 => Triangle([a, b, a.lerp(b, 0.5)]),
            2 => *triangles.last().unwrap_or(&Triangle([a, b, c])),
            _ => Triangle([a, b, c]),
        });
    }
    of_triangles(&triangles)
}

/// Three vertices for each triangle.
pub(super) fn of_triangles(triangles: &[Triangle]) -> TriangleMesh {
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    TriangleMesh::new(triangles.iter().flat_map(|t| t.0).collect(), indices)
}

/// The mesh with every vertex moved.
pub(super) fn moved(mesh: &TriangleMesh, to: impl Fn(Vec3) -> Vec3) -> TriangleMesh {
    TriangleMesh::new(mesh.vertices().iter().map(|v| to(*v)).collect(), mesh.triangles().to_vec())
}

/// A triangle of the mesh, any of its corners first.
pub(super) fn any_triangle(mesh: &TriangleMesh, random: &mut Random) -> [Vec3; 3] {
    let mut corners = mesh.triangle(random.below(mesh.len())).0;
    corners.rotate_left(random.below(3));
    corners
}

/// A corner, a point of an edge or of the inside of a triangle.
pub(super) fn target(mesh: &TriangleMesh, random: &mut Random) -> Vec3 {
    let [a, b, c] = any_triangle(mesh, random);
    match random.below(4) {
        0 => a,
        1 => (a + b) * 0.5,
        2 => a.lerp(b, random.unit()),
        _ => a.lerp(b, random.unit()).lerp(c, random.unit()),
    }
}

/// From `origin`, through what it is aimed at.
pub(super) fn towards(origin: Vec3, target: Vec3) -> Ray {
    Ray::new(origin, target - origin, f32::INFINITY)
}

/// From a point within `core` of the `centre`, at corners, edges and insides of the mesh, and
/// anywhere.
pub(super) fn from_inside(
    mesh: &TriangleMesh,
    random: &mut Random,
    centre: Vec3,
    core: Vec3,
) -> Ray {
    let origin = centre + random.point() * core;
    let target = if random.below(8) == 0 {
        centre + random.point() * core * 3.0
    } else {
        target(mesh, random)
    };
    let direction = if target == origin { core } else { target - origin };
    Ray::new(origin, direction, f32::INFINITY)
}
