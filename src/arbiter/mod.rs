//! The judge: the one true answer for a ray and a scene, by exact arithmetic on the `f32` inputs.
//!
//! A ray hits a triangle if there is a `t` in its closed interval with `o + t d` in the closed
//! triangle, and the ray is not parallel to the triangle's plane; rays and triangles that
//! [are none](is_ray) hit nothing. The decision is [made in rational numbers](exact_hits) by solving
//! for the crossing, which shares nothing with the kernels' tests of edges. In front of it, an `f64`
//! filter decides what is certain (`filter`), and boxes widened by a proven bound leave few triangles
//! to decide on (`boxes`). Tests hold both against the rational numbers alone.

mod boxes;
mod exact;
mod explain;
mod filter;

pub use exact::hits as exact_hits;
pub use explain::{Reason, Verdict};

use crate::geometry::Triangle;
use crate::ray::Ray;
use crate::tree::{Bvh2, MAX_DEPTH};
use boxes::BoxRay;
use filter::FilterRay;

/// Whether `ray` can hit anything at all: its origin and direction are finite, the direction is not
/// zero, and the interval is not empty (a NaN is in none).
pub fn is_ray(ray: &Ray) -> bool {
    let finite = ray.origin.is_finite() && ray.direction.is_finite();
    finite && ray.direction != glam::Vec3::ZERO && ray.t_min <= ray.t_max
}

/// Whether `ray` hits `triangle`, whose corners are finite.
pub fn hits(ray: &Ray, triangle: &Triangle) -> bool {
    is_ray(ray) && decided(ray, &FilterRay::new(ray), triangle)
}

fn decided(ray: &Ray, filter: &FilterRay, triangle: &Triangle) -> bool {
    filter.hits(triangle).unwrap_or_else(|| exact_hits(ray, triangle))
}

/// Judges rays through the triangles of one scene.
#[derive(Clone, Copy, Debug)]
pub struct Arbiter<'a> {
    tree: &'a Bvh2,
}

impl<'a> Arbiter<'a> {
    /// Over the triangles of `tree`, in which every box holds the whole of the triangles below it:
    /// that of a builder that does not cut triangles. Nothing else of the tree matters.
    pub fn new(tree: &'a Bvh2) -> Self {
        Self { tree }
    }

    /// Whether anything is in the ray's way.
    pub fn occluded(&self, ray: &Ray) -> bool {
        if !is_ray(ray) {
            return false;
        }
        let filter = FilterRay::new(ray);
        // Rational numbers are slow: only if no certain hit is found, and once for equal triangles,
        // which are neighbours in the tree.
        let mut in_doubt: Vec<&Triangle> = Vec::new();
        let certain = self.any_slot(&BoxRay::new(ray), |slot| {
            let triangle = &self.tree.triangles[slot];
            filter.hits(triangle).unwrap_or_else(|| {
                if in_doubt.last().is_none_or(|last| *last != triangle) {
                    in_doubt.push(triangle);
                }
                false
            })
        });
        certain || in_doubt.into_iter().any(|triangle| exact_hits(ray, triangle))
    }

    /// Whether `found` says so of the slot of any triangle in a leaf that `ray` may meet.
    fn any_slot(&self, ray: &BoxRay, mut found: impl FnMut(usize) -> bool) -> bool {
        let Some(root) = self.tree.root.filter(|_| ray.may_meet(&self.tree.bounds)) else {
            return false;
        };
        // One child waits at each node on the way down, and two at the last.
        let mut stack = [root; MAX_DEPTH + 1];
        let mut waiting = 1;
        while waiting > 0 {
            waiting -= 1;
            let child = stack[waiting];
            if child.is_leaf() {
                if child.leaf_slots().any(&mut found) {
                    return true;
                }
                continue;
            }
            let node = &self.tree.nodes[child.node_index()];
            for (child, bounds) in node.children.iter().zip(&node.bounds) {
                if ray.may_meet(bounds) {
                    stack[waiting] = *child;
                    waiting += 1;
                }
            }
        }
        false
    }
}

#[cfg(test)]
mod tests;
