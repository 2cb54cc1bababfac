//! Intervals that end at what is in the way.

use super::{CaseEntry, Stage};
use crate::geometry::{Triangle, Vec3};
use crate::ray::Ray;
use crate::stress::Random;
use crate::stress::shapes::{any_triangle, of_triangles, soup, towards};

pub(super) static INTERVAL_ENDS: CaseEntry = CaseEntry {
    name: "interval-ends",
    about: "t_max or t_min at the blocker's distance, or one or two numbers beside it",
    stages: |seed| {
        let mesh = soup(&mut Random::new(seed, "interval-ends", 0), 60);
        Ok(Stage::only(mesh, |mesh, random| {
            let [a, b, c] = any_triangle(mesh, random);
            let inside = a + (b - a) * 0.3 + (c - a) * (0.3 * random.unit() + 0.1);
            let ray = towards(random.point() * 2.0, inside);
            let direction = ray.direction * random.pick(&[1.0, 0.3, 7.0]);
            let [origin, a, b, c] = [ray.origin, a, b, c].map(|v| v.as_dvec3());
            let normal = (b - a).cross(c - a);
            let t = (a - origin).dot(normal) / direction.as_dvec3().dot(normal);
            let end = beside(t as f32, random);
            match random.below(3) {
                0 => Ray { direction, t_min: end, ..ray },
                1 => Ray { direction, t_min: end, t_max: end, ..ray },
                _ => Ray { direction, t_max: end, ..ray },
            }
        }))
    },
};

pub(super) static EXACT_ENDS: CaseEntry = CaseEntry {
    name: "exact-ends",
    about: "the same where distances are whole numbers, so that the end is exactly at the blocker",
    stages: |_| {
        let mut triangles = Vec::new();
        for axis in 0..3 {
            for layer in 1..4u8 {
                let corner = |u: f32, v: f32| {
                    let mut p = Vec3::splat(f32::from(layer));
                    p[(axis + 1) % 3] = u;
                    p[(axis + 2) % 3] = v;
                    p
                };
                let (a, b, c) = (corner(-4.0, -4.0), corner(12.0, -4.0), corner(-4.0, 12.0));
                triangles.push(Triangle([a, b, c]));
            }
        }
        Ok(Stage::only(of_triangles(&triangles), |_, random| {
            let mut whole = || random.below(17) as f32 - 8.0;
            let origin = Vec3::new(whole(), whole(), whole());
            let mut direction = Vec3::new(whole(), whole(), whole());
            if random.below(2) == 0 {
                direction = Vec3::AXES[random.below(3)] * random.pick(&[-2.0, -1.0, 1.0, 2.0]);
            }
            let t = random.below(17) as f32 * 0.5 - 2.0;
            let t = beside(t, random);
            match random.below(2) {
                0 => Ray { t_min: t, ..Ray::new(origin, direction, f32::INFINITY) },
                _ => Ray { t_min: f32::NEG_INFINITY, ..Ray::new(origin, direction, t) },
            }
        }))
    },
};

/// `t`, or a number at most two places from it.
fn beside(t: f32, random: &mut Random) -> f32 {
    match random.below(5) {
        0 => t,
        1 => t.next_up(),
        2 => t.next_down(),
        3 => t.next_up().next_up(),
        _ => t.next_down().next_down(),
    }
}
