//! The points that several camera rays see at once: lane by lane what [`SurfacePoint::new`] computes,
//! operation by operation, so to the same bits.
//!
//! One loop without a branch, compiled for the vectors that there are.

use super::surface::{SurfacePoint, offset_distance};
use crate::geometry::{Triangle, TriangleMesh};
use crate::ray::{Hit, Ray};
use crate::vectorized::{cross, dot, minus, vectorized};
use glam::{DVec3, Vec3};

const LANES: usize = 8;

type Floats = [f32; LANES];
type Doubles = [f64; LANES];

/// Makes `points` those that `rays` see, in their order, of which each has its element of `hits`.
pub(super) fn points_seen(
    mesh: &TriangleMesh,
    rays: &[Ray],
    hits: &[Option<Hit>],
    points: &mut Vec<SurfacePoint>,
) {
    points.clear();
    let mut seen = rays.iter().zip(hits).filter_map(|(ray, hit)| Some((ray, (*hit)?)));
    let mut lanes = Lanes::default();
    loop {
        let mut given = [None; LANES];
        let mut count = 0;
        for (ray, hit) in seen.by_ref().take(LANES) {
            let triangle = mesh.triangle(hit.triangle as usize);
            lanes.set(count, &triangle, ray);
            given[count] = Some((triangle, ray));
            count += 1;
        }
        if count == 0 {
            return;
        }
        let points_of_lanes = vectorized(
            #[inline(always)]
            || see(&lanes),
        );
        for (lane, (triangle, ray)) in given.iter().flatten().enumerate() {
            let point = points_of_lanes.point(lane);
            points.push(point.unwrap_or_else(|| SurfacePoint::new(triangle, ray)));
        }
    }
}

/// Triangles, each with a ray that hits it.
#[derive(Default)]
struct Lanes {
    corners: [[Floats; 3]; 3],
    origin: [Floats; 3],
    direction: [Floats; 3],
}

impl Lanes {
    #[inline]
    fn set(&mut self, lane: usize, triangle: &Triangle, ray: &Ray) {
        for axis in 0..3 {
            for (rows, corner) in self.corners.iter_mut().zip(&triangle.0) {
                rows[axis][lane] = corner[axis];
            }
            self.origin[axis][lane] = ray.origin[axis];
            self.direction[axis][lane] = ray.direction[axis];
        }
    }
}

#[derive(Default)]
struct Points {
    position: [Doubles; 3],
    origin: [Floats; 3],
    normal: [Doubles; 3],
    distance: Doubles,
    /// 0 where the ray runs along the plane, or the triangle has none.
    usable: Doubles,
}

impl Points {
    #[inline]
    fn point(&self, lane: usize) -> Option<SurfacePoint> {
        (self.usable[lane] != 0.0).then(|| SurfacePoint {
            position: DVec3::from_array(self.position.map(|row| row[lane])),
            origin: Vec3::from_array(self.origin.map(|row| row[lane])),
            normal: DVec3::from_array(self.normal.map(|row| row[lane])),
            distance: self.distance[lane],
        })
    }
}

/// The points that the lanes' rays see; those of lanes that hold nothing mean nothing.
#[inline(always)]
fn see(lanes: &Lanes) -> Points {
    let mut points = Points::default();
    // In arrays of its own, so that compilers see that nothing in the loop depends on another lane.
    let wide = |rows: &[Floats; 3]| rows.map(|row| row.map(f64::from));
    let corners = [wide(&lanes.corners[0]), wide(&lanes.corners[1]), wide(&lanes.corners[2])];
    let (origins, directions) = (wide(&lanes.origin), wide(&lanes.direction));
    for lane in 0..LANES {
        let of = |rows: &[Doubles; 3]| [rows[0][lane], rows[1][lane], rows[2][lane]];
        let [a, b, c] = [of(&corners[0]), of(&corners[1]), of(&corners[2])];
        let (origin, direction) = (of(&origins), of(&directions));
        let (ab, ac) = (minus(b, a), minus(c, a));

        let (to_origin, p) = (minus(origin, a), cross(direction, ac));
        let inverse = 1.0 / dot(ab, p);
        let u = dot(to_origin, p) * inverse;
        let v = dot(direction, cross(to_origin, ab)) * inverse;
        let meets = u.is_finite() & v.is_finite();
        let (u, v) = (max(u, 0.0), max(v, 0.0));
        let sum = max(u + v, 1.0);
        let (u, v) = (u / sum, v / sum);
        let mut position = [0.0; 3];
        for axis in 0..3 {
            position[axis] = a[axis] + ab[axis] * u + ac[axis] * v;
        }

        let normal = cross(ab, ac);
        let reciprocal = 1.0 / dot(normal, normal).sqrt();
        let has_normal = reciprocal.is_finite() & (reciprocal > 0.0);
        let normal = normal.map(|x| x * reciprocal);
        let away = dot(normal, direction) > 0.0;
        let normal = normal.map(|x| if away { -x } else { x });

        let far = |corner: [f64; 3]| largest(minus(corner, position));
        let extent = max(max(far(a), far(b)), far(c));
        let offset = offset_distance(largest(position), extent);
        for axis in 0..3 {
            points.position[axis][lane] = position[axis];
            points.origin[axis][lane] = (position[axis] + normal[axis] * offset) as f32;
            points.normal[axis][lane] = normal[axis];
        }
        let seen_from = minus(position, origin);
        points.distance[lane] = dot(seen_from, seen_from).sqrt();
        points.usable[lane] = if meets & has_normal { 1.0 } else { 0.0 };
    }
    points
}

#[inline(always)]
fn max(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[inline(always)]
fn largest(a: [f64; 3]) -> f64 {
    max(max(a[0].abs(), a[1].abs()), a[2].abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    #[test]
    fn points_are_those_of_single_rays() {
        let mut random = Random::new(0x5ee);
        for round in 0..400 {
            let scale = [1.0, 1e-3, 1e6, 1e-30][round % 4];
            let mut mesh = random.mesh(40);
            let vertices = mesh.vertices().iter().map(|v| *v * scale).collect();
            mesh = TriangleMesh::new(vertices, mesh.triangles().to_vec());
            let (mut rays, mut hits) = (Vec::new(), Vec::new());
            for _ in 0..round % 70 {
                let triangle = (random.bits() % mesh.len() as u64) as u32;
                let [a, b, c] = mesh.triangle(triangle as usize).0;
                let target = a.lerp(b, random.unit()).lerp(c, random.unit());
                let mut ray = random.ray();
                match random.bits() % 8 {
                    // Along an edge, and anywhere.
                    0 => ray.direction = b - a,
                    1 => {}
                    _ => ray.direction = target - ray.origin,
                }
                rays.push(ray);
                let hit = Hit { t: 1.0, triangle };
                hits.push((!random.bits().is_multiple_of(4)).then_some(hit));
            }
            let mut points = Vec::new();
            points_seen(&mesh, &rays, &hits, &mut points);
            let seen = rays.iter().zip(&hits).filter_map(|(ray, hit)| Some((ray, (*hit)?)));
            let expected: Vec<_> = seen
                .map(|(ray, hit)| SurfacePoint::new(&mesh.triangle(hit.triangle as usize), ray))
                .collect();
            assert_eq!(points.len(), expected.len());
            for (point, expected) in points.iter().zip(&expected) {
                assert_eq!(bits(point), bits(expected), "round {round}: {point:?} {expected:?}");
            }
        }
    }

    fn bits(point: &SurfacePoint) -> (Vec<u64>, Vec<u32>) {
        let SurfacePoint { position, origin, normal, distance } = *point;
        let doubles = [position.to_array(), normal.to_array(), [distance; 3]].concat();
        // Adding zero: of zeros the sign is of no account.
        let doubles = doubles.into_iter().map(|x| (x + 0.0).to_bits()).collect();
        (doubles, origin.to_array().map(|x| (x + 0.0).to_bits()).to_vec())
    }
}
