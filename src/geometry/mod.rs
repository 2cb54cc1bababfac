//! Vectors, boxes and triangles. Everything is `f32` as given by the scene; nothing here rounds
//! silently except where a comment says so.

mod aabb;
mod mesh;

pub use aabb::Aabb;
pub use glam::{Mat4, Vec3};
pub use mesh::{Triangle, TriangleMesh};
