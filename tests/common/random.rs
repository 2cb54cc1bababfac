//! Seeded random geometry for tests. Failing tests print the seed or the case.
#![allow(unreachable_pub, reason = "also a module of the library's unit tests")]

use glam::Vec3;
use sato::geometry::{Triangle, TriangleMesh};
use sato::ray::Ray;

/// SplitMix64 (Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", 2014).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        println!("random seed {seed:#x}");
        Self(seed)
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In `[0, 1)`.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u32 << 24) as f32
    }

    /// In `[-4, 4)` on each axis; now and then on a coarse grid, where degenerate cases live.
    pub fn point(&mut self) -> Vec3 {
        let p = Vec3::new(self.unit(), self.unit(), self.unit()) * 8.0 - 4.0;
        if self.bits().is_multiple_of(4) { p.round() } else { p }
    }

    /// From a random point through another; now and then along an axis or with a short interval.
    pub fn ray(&mut self) -> Ray {
        let (origin, target) = (self.point(), self.point());
        let mut direction = target - origin;
        match self.bits() % 8 {
            0 => direction = Vec3::AXES[(self.bits() % 3) as usize] * 0.5,
            1 => direction = -Vec3::AXES[(self.bits() % 3) as usize],
            2 => direction[(self.bits() % 3) as usize] = -0.0,
            _ => {}
        }
        if direction == Vec3::ZERO {
            direction = Vec3::X;
        }
        let t_max = if self.bits().is_multiple_of(2) { f32::INFINITY } else { self.unit() * 2.0 };
        Ray::new(origin, direction, t_max)
    }

    /// `count` triangles, some large, most small, some degenerate or twice.
    pub fn mesh(&mut self, count: usize) -> TriangleMesh {
        let mut corners: Vec<Triangle> = Vec::new();
        while corners.len() < count {
            let a = self.point();
            let size = if self.bits().is_multiple_of(16) { 4.0 } else { 0.3 };
            let mut near = || a + (Vec3::new(self.unit(), self.unit(), self.unit()) - 0.5) * size;
            let (b, c) = (near(), near());
            corners.push(match self.bits() % 32 {
                0 => Triangle([a, a, b]),
                1 => Triangle([a, b, a.lerp(b, 0.5)]),
                2 => *corners.last().unwrap_or(&Triangle([a, b, c])),
                _ => Triangle([a, b, c]),
            });
        }
        let triangles = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        TriangleMesh::new(corners.iter().flat_map(|t| t.0).collect(), triangles)
    }
}
