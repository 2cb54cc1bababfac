//! A sheet falls over a moving ball and drapes it, in a hall with pillars.
//!
//! In closed form: along each ray from the middle, the sheet lies on the ball up to an angle that grows
//! with time, then hangs off along the tangent. What its outline has too much of goes into folds.

use super::kit::{
    Moving, PI, Place, Rng, Shape, TAU, V, aimed_quad, at, camera, cos, light, mix, sin, sin_cos,
    tilted, v,
};
use super::{Generated, GeneratorEntry};
use crate::geometry::Vec3;
use crate::scene::{LightShape, Pose};
use rayon::prelude::*;

/// The catalogue's entry.
pub(super) static ENTRY: GeneratorEntry = GeneratorEntry {
    name: "cloth",
    about: "207k triangles, moving: a sheet falls over a ball that drifts through a pillared hall",
    triangles: 207_000,
    generate,
};

const FRAMES: usize = 20;
/// Squares along an edge of the sheet.
const CELLS: u32 = 316;
/// Edge of the sheet.
const SIDE: f64 = 4.8;
const BALL_RADIUS: f64 = 1.2;
/// The sheet's, where it lies on the ball.
const LYING_RADIUS: f64 = BALL_RADIUS + 0.012;
/// When the sheet touches the ball.
const TOUCH: f64 = 0.2;
/// The angle from the top down to which it covers the ball in the end.
const COVERED: f64 = 1.3;
/// Vertices posed at a time on one thread.
const CHUNK: usize = 1 << 12;

fn generate(seed: u64) -> Generated {
    let mut scene = Moving::default();
    scene.stand(hall());
    let (vertices, triangles) = Shape::of(|s| s.ball(V::ZERO, BALL_RADIUS, 64, 32)).into_parts();
    scene.add_moving(&triangles, vertices.len());
    scene.pose(Ball(vertices));
    let sheet = Shape::of(|s| {
        s.grid([CELLS, CELLS], [false, false], |u, w| v(u - 0.5, 0.0, 0.5 - w) * SIDE);
    });
    let (vertices, triangles) = sheet.into_parts();
    scene.add_moving(&triangles, vertices.len());
    // The seed turns the folds.
    let turn = Rng::new(seed, "folds").angle();
    scene.pose(Sheet { flat: vertices, turn: [cos(turn), sin(turn)] });
    let (mesh, motion) = scene.finish(FRAMES);
    Generated {
        mesh,
        camera: camera(v(3.9, 3.2, 6.6), v(0.0, 1.7, -0.4), 50.0),
        lights: vec![
            light(
                "window",
                aimed_quad(v(-4.6, 5.6, 3.0), v(0.0, 1.2, 0.0), 2.0, 1.4),
                55.0,
                v(1.0, 0.95, 0.86),
            ),
            light(
                "lantern",
                LightShape::Sphere { center: glam::vec3(3.4, 4.6, -2.6), radius: 0.3 },
                60.0,
                v(0.8, 0.88, 1.0),
            ),
        ],
        ao_radius: 1.0,
        motion: Some(motion),
    }
}

/// Walls, pillars with foot and head, and a plinth along the back.
fn hall() -> Shape {
    Shape::of(|s| {
        s.room(v(-7.0, 0.0, -7.0), v(7.0, 6.5, 9.0), 0);
        let pillar = Shape::of(|s| {
            s.bevelled(V::ZERO, v(0.9, 0.25, 0.9), 0.03);
            let profile =
                [(0.0, 0.24), (0.4, 0.24), (0.42, 0.32), (0.33, 0.42), (0.28, 5.3), (0.45, 5.6)];
            s.lathe(&profile, 32);
            s.bevelled(v(0.0, 5.6, 0.0), v(1.0, 0.3, 1.0), 0.03);
        });
        for x in [-4.6, 4.6] {
            for z in [-4.6, -1.4, 1.8, 5.0] {
                s.add(&pillar, at(v(x, -0.002, z)));
            }
        }
        for x in [-4.6, 4.6] {
            s.block(v(x, 5.898, 1.0), v(1.0, 0.61, 15.9));
        }
        s.bevelled(v(0.0, -0.002, -6.4), v(7.0, 0.9, 1.1), 0.04);
    })
}

/// The ball's middle.
fn middle(time: f64) -> V {
    v(mix(-1.3, 1.3, time), 1.75 + 0.15 * sin(TAU * time), 0.7 * sin(PI * (1.5 * time - 0.4)))
}

#[derive(Debug)]
struct Ball(Vec<V>);

impl Pose for Ball {
    fn pose(&self, time: f64, vertices: &mut [Vec3]) {
        let place: Place = tilted(middle(time), 0.0, 0.0, -middle(time).x / BALL_RADIUS);
        for (there, &p) in vertices.iter_mut().zip(&self.0) {
            *there = place.transform_point3(p).as_vec3();
        }
    }
}

#[derive(Debug)]
struct Sheet {
    /// Spread out around the origin.
    flat: Vec<V>,
    /// Cosine and sine of the angle by which folds are turned.
    turn: [f64; 2],
}

impl Pose for Sheet {
    fn pose(&self, time: f64, vertices: &mut [Vec3]) {
        let ball = middle(time);
        let now = Draping::at(time);
        let pairs = vertices.par_chunks_mut(CHUNK).zip(self.flat.par_chunks(CHUNK));
        pairs.for_each(|(vertices, flat)| {
            for (there, &p) in vertices.iter_mut().zip(flat) {
                let place = if time < TOUCH { falling(p, time) } else { self.draped(p, &now) };
                *there = (ball + place).as_vec3();
            }
        });
    }
}

/// What all vertices of the sheet share from the touch on.
struct Draping {
    /// The angle down to which the ball is covered, with its sine and cosine.
    covered: f64,
    sin_cos: (f64, f64),
    /// How far one unit of hanging sheet stays behind.
    lag: V,
}

impl Draping {
    fn at(time: f64) -> Self {
        let left = 1.0 - (time - TOUCH).max(0.0) / (1.0 - TOUCH);
        let done = 1.0 - left * left * left;
        let lag = (middle(time - 0.06) - middle(time)) * (0.8 * done);
        Self { covered: COVERED * done, sin_cos: sin_cos(COVERED * done), lag }
    }
}

/// Flat but for ripples that die down, on its way down to the ball; seen from the ball's middle.
fn falling(p: V, time: f64) -> V {
    let fallen = time / TOUCH;
    let high = 1.4 * (1.0 - fallen * fallen);
    let ripple = 0.07 * (1.0 - fallen) * sin(2.6 * p.x + 1.0) * cos(1.9 * p.z - 7.0 * time);
    v(p.x, LYING_RADIUS + high + ripple, p.z)
}

impl Sheet {
    /// Where the point at `p` of the flat sheet is, seen from the ball's middle.
    fn draped(&self, p: V, now: &Draping) -> V {
        let along = p.length();
        let free = along - LYING_RADIUS * now.covered;
        if free <= 0.0 {
            let (sine, cosine) = sin_cos(along / LYING_RADIUS);
            // Along the meridian; near the top the two lengths go to zero together.
            let out = if along > 0.0 { sine * LYING_RADIUS / along } else { 1.0 };
            return v(p.x * out, LYING_RADIUS * cosine, p.z * out);
        }
        let (sine, cosine) = now.sin_cos;
        let out = LYING_RADIUS * sine + free * cosine;
        let down = free * sine - LYING_RADIUS * cosine;
        // The circle through the sheet is longer than the one around the ball: that is in folds.
        let excess = (along / out - 1.0).max(0.0);
        let ramp = free / (free + 0.35);
        let depth = 0.2 * ramp * excess.sqrt().min(1.2);
        let ray = [p.x / along, p.z / along];
        let [_, wave] = times(power(ray, 11), self.turn);
        let [_, slow] = times(power(ray, 5), self.turn);
        let folded = out * (1.0 + depth * wave + 0.3 * depth * slow);
        v(ray[0] * folded, -down - 0.12 * depth * wave, ray[1] * folded) + now.lag * free
    }
}

/// The product of two complex numbers: angles add up.
fn times(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

fn power(a: [f64; 2], n: u32) -> [f64; 2] {
    (0..n).fold([1.0, 0.0], |product, _| times(product, a))
}
