//! Bounds of all rays of a packet at once.

use crate::geometry::Aabb;
use crate::intersect::PreparedRay;

/// Lower and upper bound of a number over the rays of a packet.
#[derive(Clone, Copy, Debug)]
struct Span {
    low: f32,
    high: f32,
}

impl Span {
    const EMPTY: Self = Self { low: f32::INFINITY, high: f32::NEG_INFINITY };

    fn with(self, value: f32) -> Self {
        Self { low: self.low.min(value), high: self.high.max(value) }
    }
}

/// The rays' box tests in interval arithmetic.
///
/// A ray enters a slab at `fl(fl(plane - origin) * reciprocal)`. Rounded subtraction is monotone,
/// so the difference lies between those with the bounds of the origins; a rounded product is
/// monotone in each factor, so that with a number between two bounds lies between the products with
/// these. Bounds of the entries and exits of all rays follow, bit for bit and not up to rounding,
/// and if the one is after the other no ray can have its entry before its exit.
///
/// On an axis where rays go both ways, their entry planes differ: nothing is said there.
/// Reciprocals are finite and not zero, so that no product is NaN; were one, the comparison would
/// be false and the box not missed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    near_origin: [Span; 3],
    far_origin: [Span; 3],
    reciprocal: [Span; 3],
    /// Whether the entry plane is the upper one; `None` where rays differ.
    descending: [Option<bool>; 3],
    t_min: f32,
    t_max: f32,
}

impl Interval {
    pub(super) fn around<'a>(rays: impl Iterator<Item = &'a PreparedRay>) -> Self {
        let mut all = Self {
            near_origin: [Span::EMPTY; 3],
            far_origin: [Span::EMPTY; 3],
            reciprocal: [Span::EMPTY; 3],
            descending: [None; 3],
            t_min: f32::INFINITY,
            t_max: f32::NEG_INFINITY,
        };
        for slabs in rays.map(PreparedRay::slabs) {
            for axis in 0..3 {
                all.near_origin[axis] = all.near_origin[axis].with(slabs.near_origin[axis]);
                all.far_origin[axis] = all.far_origin[axis].with(slabs.far_origin[axis]);
                all.reciprocal[axis] = all.reciprocal[axis].with(slabs.reciprocal[axis]);
            }
            all.t_min = all.t_min.min(slabs.t_min);
            all.t_max = all.t_max.max(slabs.t_max);
        }
        all.descending = all.reciprocal.map(|r| {
            if r.low > 0.0 {
                Some(false)
            } else if r.high < 0.0 {
                Some(true)
            } else {
                None
            }
        });
        all
    }

    /// Whether every ray misses `bounds`; `false` does not say that any meets it.
    #[inline]
    pub(super) fn all_miss(&self, bounds: &Aabb) -> bool {
        let (mut entry, mut exit) = (self.t_min, self.t_max);
        for axis in 0..3 {
            let (lower, upper) = (bounds.min[axis], bounds.max[axis]);
            let reciprocal = self.reciprocal[axis];
            let (near, far) = match self.descending[axis] {
                // Ascending, the smallest difference gives the first entry; descending, the largest
                // difference, as it is multiplied by a negative number.
                Some(false) => {
                    (lower - self.near_origin[axis].high, upper - self.far_origin[axis].low)
                }
                Some(true) => {
                    (upper - self.near_origin[axis].low, lower - self.far_origin[axis].high)
                }
                None => continue,
            };
            entry = entry.max((near * reciprocal.low).min(near * reciprocal.high));
            exit = exit.min((far * reciprocal.low).max(far * reciprocal.high));
        }
        entry > exit
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;
    use crate::ray::Ray;
    use crate::test_random::Random;

    /// Rays like those of a tile: from and to near points, some of them along planes.
    fn packet(random: &mut Random, offset: Vec3) -> Vec<Ray> {
        let spread = [1e-3, 0.1, 8.0][(random.bits() % 3) as usize];
        let first = random.ray();
        let count = 1 + random.bits() % 8;
        let mut rays = vec![Ray { origin: first.origin + offset, ..first }];
        for _ in 0..count {
            let near = |random: &mut Random| random.point() * spread * 0.25;
            let mut ray = Ray { direction: first.direction + near(random), ..first };
            ray.origin += near(random) + offset;
            if random.bits().is_multiple_of(8) {
                ray.direction[(random.bits() % 3) as usize] =
                    [0.0, -0.0][random.bits() as usize % 2];
            }
            ray.t_max *= random.unit() + 0.5;
            rays.push(ray);
        }
        rays
    }

    #[test]
    fn no_box_is_rejected_that_a_ray_meets() {
        let mut random = Random::new(0x1a7e);
        let (mut met, mut rejected) = (0, 0);
        for round in 0..300_000 {
            let offset = [Vec3::ZERO, Vec3::new(1e6, -3e4, 7e3)][round % 2];
            let scene = Aabb { min: Vec3::splat(-4.0) + offset, max: Vec3::splat(4.0) + offset };
            let rays = packet(&mut random, offset);
            let prepared: Vec<_> =
                rays.iter().filter_map(|ray| PreparedRay::new(ray, &scene)).collect();
            let interval = Interval::around(prepared.iter());
            for _ in 0..8 {
                // Flat, small and large boxes, some touching the plane of a ray's origin.
                let ray = rays[(random.bits() % rays.len() as u64) as usize];
                let a = match random.bits() % 2 {
                    0 => random.point() + offset,
                    _ => ray.at(random.unit()) + random.point() * 1e-3,
                };
                let mut b = a + random.point() * [0.01, 0.1, 1.0][(random.bits() % 3) as usize];
                if random.bits().is_multiple_of(4) {
                    let axis = (random.bits() % 3) as usize;
                    b[axis] = a[axis];
                }
                let bounds = Aabb::of_points([a, b]);
                let any = prepared.iter().any(|ray| ray.enter(&bounds).is_some());
                let all_miss = interval.all_miss(&bounds);
                assert!(!(any && all_miss), "{rays:?} {bounds:?}");
                met += usize::from(any);
                rejected += usize::from(all_miss);
            }
        }
        assert!(met > 200_000 && rejected > 500_000, "{met} met, {rejected} rejected");
    }
}
