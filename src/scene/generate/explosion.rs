//! A stone egg on a pedestal bursts: fragments fly apart, tumble, bounce off walls and come to rest.

use super::kit::{Moving, Rng, Shape, V, at, camera, light, mix, noise, sin_cos, v};
use super::{Generated, GeneratorEntry};
use crate::geometry::Vec3;
use crate::scene::{LightShape, Pose};
use glam::DMat3;
use rayon::prelude::*;

/// The catalogue's entry.
pub(super) static ENTRY: GeneratorEntry = GeneratorEntry {
    name: "explosion",
    about: "107k triangles, moving: 973 fragments of a stone egg fly apart in a walled yard",
    triangles: 107_000,
    generate,
};

const FRAMES: usize = 20;
/// From the first frame to the last.
const SECONDS: f64 = 1.7;
const GRAVITY: f64 = 9.81;
/// Fragments along an edge of each face of the cube that the egg is cut by.
const CUTS: u32 = 9;
/// Radii between which the layers lie, of 1 at the surface.
const LAYERS: [f64; 3] = [0.45, 0.74, 1.0];
/// Squares along an edge of each of a fragment's six sides.
const CELLS: u32 = 3;
const CENTER: V = v(0.0, 3.0, 0.0);
/// Where fragments bounce: x to either side, and z at the back.
const WALLS: (f64, f64) = (6.8, -5.8);
/// The part of its speed that a fragment has left after it hit the ground.
const BOUNCE: f64 = 0.35;

fn generate(seed: u64) -> Generated {
    let mut scene = Moving::default();
    scene.stand(yard());
    let mut rng = Rng::new(seed, "fragments");
    let mut fragments = Vec::new();
    let mut add = |scene: &mut Moving, shape: Shape, rng: &mut Rng| {
        let (vertices, triangles) = shape.into_parts();
        scene.add_moving(&triangles, vertices.len());
        fragments.push(Fragment::new(vertices, rng));
    };
    for face in 0..6 {
        for layer in LAYERS.windows(2) {
            for i in 0..CUTS * CUTS {
                let shape = cell(seed, face, [i % CUTS, i / CUTS], [layer[0], layer[1]]);
                add(&mut scene, shape, &mut rng);
            }
        }
    }
    let core = Shape::of(|s| s.icosphere(V::ZERO, 0.44, 2));
    add(&mut scene, core.placed(at(CENTER)), &mut rng);
    scene.pose(Burst(fragments));
    let (mesh, motion) = scene.finish(FRAMES);
    Generated {
        mesh,
        camera: camera(v(4.6, 3.4, 11.5), v(-0.2, 2.3, 0.0), 48.0),
        lights: vec![
            light(
                "sun",
                LightShape::Directional {
                    direction: glam::vec3(0.55, -0.62, -0.56).normalize(),
                    angular_diameter_degrees: 1.5,
                },
                2.6,
                v(1.0, 0.95, 0.85),
            ),
            light(
                "flash",
                LightShape::Sphere { center: glam::vec3(3.0, 7.0, 4.0), radius: 0.5 },
                45.0,
                v(1.0, 0.8, 0.55),
            ),
        ],
        ao_radius: 1.0,
        motion: Some(motion),
    }
}

/// Ground, three walls with merlons, and the pedestal.
fn yard() -> Shape {
    Shape::of(|s| {
        let p = |x: f64, z: f64| v(x * 60.0, 0.0, z * 60.0);
        s.quad(p(-1.0, 1.0), p(1.0, 1.0), p(1.0, -1.0), p(-1.0, -1.0));
        s.block(v(0.0, -0.01, -6.5), v(15.0, 4.5, 0.8));
        for k in 0..13 {
            s.bevelled(v(-6.9 + 1.15 * f64::from(k), 4.48, -6.5), v(0.6, 0.6, 0.7), 0.04);
        }
        for x in [-7.5, 7.5] {
            s.block(v(x, -0.01, -1.6), v(0.8, 3.2, 9.0));
            for k in 0..8 {
                s.bevelled(v(x, 3.18, -5.6 + 1.15 * f64::from(k)), v(0.7, 0.5, 0.6), 0.04);
            }
        }
        s.bevelled(v(0.0, -0.01, 0.0), v(2.2, 0.36, 2.2), 0.03);
        s.lathe_at(
            v(0.0, 0.33, 0.0),
            &[
                (0.0, 0.0),
                (0.95, 0.0),
                (0.95, 0.1),
                (0.7, 0.2),
                (0.62, 0.7),
                (0.8, 0.86),
                (0.0, 0.86),
            ],
            32,
        );
    })
}

/// A point of the egg: on a face of the cube, from -1 to 1 along both, at a radius of up to 1.
fn point(seed: u64, face: u32, [a, b]: [f64; 2], radius: f64) -> V {
    // Cuts are bent, but for those along the edges of the cube, which two faces share.
    let bend = 0.3 * (1.0 - a * a) * (1.0 - b * b) / f64::from(CUTS) * 2.0;
    let salt = seed ^ u64::from(face);
    let (a, b) =
        (a + bend * noise(salt, 9.0 * a, 9.0 * b), b + bend * noise(salt ^ 0xb, 9.0 * b, 9.0 * a));
    let cube = match face {
        0 => v(1.0, a, b),
        1 => v(-1.0, b, a),
        2 => v(b, 1.0, a),
        3 => v(a, -1.0, b),
        4 => v(a, b, 1.0),
        _ => v(b, a, -1.0),
    };
    let ray = cube / cube.length();
    let bumps = 0.05 * noise(seed ^ 0xe, 2.5 * ray.x + 9.0 * ray.y, 2.5 * ray.z - 5.0);
    CENTER + ray * v(1.25, 1.75 - 0.15 * ray.y, 1.25) * (radius * (1.0 + bumps))
}

/// A fragment: a closed cell between two radii.
fn cell(seed: u64, face: u32, index: [u32; 2], layer: [f64; 2]) -> Shape {
    let bounds = index.map(|i| [i, i + 1].map(|k| f64::from(k) / f64::from(CUTS) * 2.0 - 1.0));
    let place = |a: f64, b: f64, c: f64| {
        let [a, b] = [mix(bounds[0][0], bounds[0][1], a), mix(bounds[1][0], bounds[1][1], b)];
        point(seed, face, [a, b], mix(layer[0], layer[1], c))
    };
    Shape::of(|s| {
        let size = [CELLS, CELLS];
        let open = [false, false];
        s.grid(size, open, |u, w| place(u, w, 1.0));
        s.grid(size, open, |u, w| place(w, u, 0.0));
        s.grid(size, open, |u, w| place(u, 0.0, w));
        s.grid(size, open, |u, w| place(w, 1.0, u));
        s.grid(size, open, |u, w| place(0.0, w, u));
        s.grid(size, open, |u, w| place(1.0, u, w));
    })
}

/// A fragment, and how it flies.
#[derive(Debug)]
struct Fragment {
    /// Around its middle.
    vertices: Vec<V>,
    middle: V,
    velocity: V,
    axis: V,
    /// Radians in a second.
    spin: f64,
    /// Height of its middle when it lies on the ground.
    lying: f64,
}

impl Fragment {
    fn new(vertices: Vec<V>, rng: &mut Rng) -> Self {
        let middle = vertices.iter().sum::<V>() / vertices.len() as f64;
        // Hairline cracks: no two fragments share a face.
        let vertices: Vec<V> = vertices.iter().map(|&p| (p - middle) * 0.996).collect();
        let out = middle - CENTER + v(0.0, 0.35, 0.0);
        let jitter = rng.direction() * 1.1;
        let velocity = out * rng.range(2.4, 5.6) + jitter + v(0.0, 1.2, 0.0);
        let far = vertices.iter().map(|p| p.length()).fold(0.0, f64::max);
        let (axis, spin) = (rng.direction(), rng.range(1.5, 9.0));
        Self { vertices, middle, velocity, axis, spin, lying: 0.45 * far }
    }

    /// Where its middle is after `seconds`, and by how much it has turned.
    fn flight(&self, seconds: f64) -> (V, f64) {
        let rise = self.velocity.y;
        let fall = (self.middle.y - self.lying).max(0.0);
        let landing = (rise + (rise * rise + 2.0 * GRAVITY * fall).sqrt()) / GRAVITY;
        let rebound = BOUNCE * (GRAVITY * landing - rise);
        let rest = landing + 2.0 * rebound / GRAVITY;
        let air = seconds.min(landing);
        let mut p = self.middle + self.velocity * air - V::Y * (0.5 * GRAVITY * air * air);
        let mut turned = self.spin * air;
        if seconds > landing {
            let hop = seconds.min(rest) - landing;
            p += self.velocity * (0.5 * hop);
            p.y = self.lying + rebound * hop - 0.5 * GRAVITY * hop * hop;
            turned += self.spin * 0.5 * hop;
        }
        (v(mirrored(p.x, WALLS.0), p.y, p.z.max(2.0 * WALLS.1 - p.z)), turned)
    }
}

/// `x` thrown back by walls at `wall` and `-wall`, once.
fn mirrored(x: f64, wall: f64) -> f64 {
    x.min(2.0 * wall - x).max(-2.0 * wall - x)
}

/// Turned by `angle` about `axis` (Rodrigues' formula).
fn turn(axis: V, angle: f64) -> DMat3 {
    let (s, c) = sin_cos(angle);
    let column = |e: V| e * c + axis.cross(e) * s + axis * (axis.dot(e) * (1.0 - c));
    DMat3::from_cols(column(V::X), column(V::Y), column(V::Z))
}

#[derive(Debug)]
struct Burst(Vec<Fragment>);

impl Pose for Burst {
    fn pose(&self, time: f64, vertices: &mut [Vec3]) {
        let mut rest = vertices;
        let mut pieces = Vec::with_capacity(self.0.len());
        for fragment in &self.0 {
            let (piece, others) = rest.split_at_mut(fragment.vertices.len());
            pieces.push((fragment, piece));
            rest = others;
        }
        pieces.into_par_iter().for_each(|(fragment, piece)| {
            let (middle, turned) = fragment.flight(time * SECONDS);
            let turn = turn(fragment.axis, turned);
            for (there, &p) in piece.iter_mut().zip(&fragment.vertices) {
                *there = (turn * p + middle).as_vec3();
            }
        });
    }
}
