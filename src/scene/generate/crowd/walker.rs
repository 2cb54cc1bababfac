//! People: models of closed parts on bones, and how bones move when somebody walks.

use super::super::kit::{
    PI, Place, Rng, Shape, TAU, V, at, cos, noise, sin, sin_cos, tilted, turned, v,
};
use crate::geometry::Vec3;
use crate::scene::Pose;
use glam::DMat3;
use rayon::prelude::*;
use std::ops::Range;

const TORSO: usize = 0;
const HEAD: usize = 1;
const UPPER_ARM: usize = 2;
const FOREARM: usize = 4;
const THIGH: usize = 6;
const SHIN: usize = 8;
const BONES: usize = 10;

/// Lengths in metres of somebody 1.76 m tall; feet are below the ankle.
const THIGH_LENGTH: f64 = 0.43;
const SHIN_LENGTH: f64 = 0.41;
const FOOT_HEIGHT: f64 = 0.09;
const UPPER_ARM_LENGTH: f64 = 0.28;
const NECK: V = v(0.0, 0.57, 0.0);

/// What somebody carries or wears.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Thing {
    Nothing,
    Backpack,
    Box,
    Umbrella,
    Hat,
}

/// How somebody is built.
#[derive(Clone, Copy, Debug)]
struct Build {
    hips: f64,
    waist: f64,
    chest: f64,
    shoulders: f64,
    limbs: f64,
    skirt: bool,
}

const BUILDS: [Build; 4] = [
    Build { hips: 0.17, waist: 0.15, chest: 0.19, shoulders: 0.17, limbs: 1.0, skirt: false },
    Build { hips: 0.18, waist: 0.13, chest: 0.16, shoulders: 0.14, limbs: 0.85, skirt: true },
    Build { hips: 0.21, waist: 0.24, chest: 0.22, shoulders: 0.18, limbs: 1.2, skirt: false },
    Build { hips: 0.15, waist: 0.13, chest: 0.16, shoulders: 0.15, limbs: 0.85, skirt: false },
];

const THINGS: [Thing; 5] =
    [Thing::Nothing, Thing::Backpack, Thing::Box, Thing::Umbrella, Thing::Hat];

/// A person to be posed: each part's vertices around the joint of its bone, at rest hanging down.
#[derive(Debug)]
pub(super) struct Model {
    pub(super) vertices: Vec<V>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Bone and vertices of each part, in order.
    parts: Vec<(usize, Range<usize>)>,
    thing: Thing,
}

impl Model {
    /// All kinds of people.
    pub(super) fn all(seed: u64) -> Vec<Self> {
        let kinds = BUILDS.iter().flat_map(|build| THINGS.map(|thing| (build, thing)));
        kinds
            .enumerate()
            .map(|(i, (build, thing))| Self::new(*build, thing, seed + i as u64))
            .collect()
    }

    fn new(build: Build, thing: Thing, seed: u64) -> Self {
        let mut model =
            Self { vertices: Vec::new(), triangles: Vec::new(), parts: Vec::new(), thing };
        model.add(TORSO, Shape::of(|s| torso(s, build)));
        model.add(HEAD, Shape::of(|s| head(s, thing == Thing::Hat, seed)));
        let limb = |length: f64, [top, bottom]: [f64; 2], sides: u32| {
            let (top, bottom) = (top * build.limbs, bottom * build.limbs);
            let path = [V::ZERO, v(0.0, -0.45 * length, 0.0), v(0.0, -length, 0.0)];
            Shape::of(|s| s.tube(&path, (top, bottom), sides))
        };
        for side in 0..2 {
            model.add(UPPER_ARM + side, limb(UPPER_ARM_LENGTH + 0.02, [0.06, 0.045], 5));
            let mut forearm = limb(0.24, [0.045, 0.03], 5);
            forearm.ellipsoid(v(0.0, -0.29, 0.0), v(0.04, 0.075, 0.05), 5, 3);
            model.add(FOREARM + side, forearm);
            model.add(THIGH + side, limb(THIGH_LENGTH + 0.03, [0.095, 0.06], 8));
            let mut shin = limb(SHIN_LENGTH, [0.062, 0.04], 8);
            let size = v(0.095, FOOT_HEIGHT, 0.26);
            shin.block(v(0.0, -SHIN_LENGTH - FOOT_HEIGHT, 0.06), size);
            model.add(SHIN + side, shin);
        }
        model.add(TORSO, Shape::of(|s| carried(s, thing)));
        model
    }

    fn add(&mut self, bone: usize, part: Shape) {
        let first = self.vertices.len();
        let (vertices, triangles) = part.into_parts();
        self.vertices.extend(vertices);
        self.triangles.extend(triangles.iter().map(|t| t.map(|i| i + first as u32)));
        self.parts.push((bone, first..self.vertices.len()));
    }
}

/// From the hips at the origin to the neck, with a skirt perhaps.
fn torso(s: &mut Shape, build: Build) {
    let Build { hips, waist, chest, shoulders, .. } = build;
    let profile = [
        (0.0, -0.1),
        (0.8 * hips, -0.09),
        (hips, 0.02),
        (waist, 0.2),
        (chest, 0.38),
        (shoulders, 0.49),
        (0.0, 0.54),
    ];
    let body = Shape::of(|s| s.lathe(&profile, 10));
    s.add(&body, Place::from_scale(v(1.12, 1.0, 0.68)));
    s.tube(&[v(0.0, 0.48, 0.0), v(0.0, 0.62, 0.01)], (0.055, 0.05), 6);
    if build.skirt {
        let skirt = Shape::of(|s| s.lathe(&[(0.27, -0.52), (0.23, -0.25), (waist, 0.12)], 14));
        s.add(&skirt, Place::from_scale(v(1.1, 1.0, 0.95)));
    }
}

/// Above the neck at the origin: face, hair or hat.
fn head(s: &mut Shape, hat: bool, seed: u64) {
    s.ellipsoid(v(0.0, 0.13, 0.015), v(0.08, 0.12, 0.1), 8, 6);
    if hat {
        let profile =
            [(0.0, 0.0), (0.19, 0.0), (0.19, 0.012), (0.1, 0.02), (0.085, 0.12), (0.0, 0.13)];
        s.lathe_at(v(0.0, 0.18, 0.0), &profile, 10);
    } else {
        let long = 0.02 * (1.0 + noise(seed, 0.5, 0.5));
        s.ellipsoid(v(0.0, 0.155 - long, -0.02), v(0.09, 0.105 + long, 0.1), 8, 4);
    }
}

/// Held to the torso.
fn carried(s: &mut Shape, thing: Thing) {
    match thing {
        Thing::Nothing | Thing::Hat => {}
        Thing::Backpack => s.bevelled(v(0.0, 0.1, -0.22), v(0.3, 0.38, 0.17), 0.03),
        Thing::Box => s.bevelled(v(0.0, 0.13, 0.36), v(0.42, 0.3, 0.32), 0.01),
        Thing::Umbrella => {
            let hand = v(0.26, 0.24, 0.24);
            s.rod(hand - V::Y * 0.1, hand + V::Y * 0.95, 0.01, 4);
            let profile = [(0.62, 0.66), (0.45, 0.82), (0.2, 0.93), (0.0, 0.96)];
            s.lathe_at(hand, &profile, 10);
        }
    }
}

/// Somebody on their way, along an arc.
#[derive(Debug)]
pub(super) struct Walker {
    pub(super) model: usize,
    start: V,
    heading: f64,
    /// Radians to the left for each metre; not zero.
    curvature: f64,
    /// Metres walked from time 0 to 1.
    distance: f64,
    height: f64,
    /// Where in their stride they are at first, in radians.
    phase: f64,
    /// How far the legs swing, in radians.
    swing: f64,
}

impl Walker {
    /// Somebody who walks from `start` for so many seconds.
    pub(super) fn new(start: V, models: usize, seconds: f64, rng: &mut Rng) -> Self {
        // Neighbours walk much the same way, or the opposite one.
        let along = TAU * noise(0x77a1, start.x / 17.0, start.z / 17.0);
        let back = if rng.unit() < 0.35 { PI } else { 0.0 };
        let left = if rng.unit() < 0.5 { -1.0 } else { 1.0 };
        let speed = rng.range(0.7, 1.7);
        Self {
            model: rng.below(models),
            start,
            heading: along + back + rng.range(-0.25, 0.25),
            curvature: left * rng.range(0.01, 0.12),
            distance: speed * seconds,
            height: rng.range(0.88, 1.1),
            phase: rng.angle(),
            swing: 0.18 + 0.2 * speed,
        }
    }

    /// Where they are at `time`, and which way they look, as an angle from z towards x.
    pub(super) fn place(&self, time: f64) -> (V, f64) {
        let heading = self.heading + self.curvature * self.distance * time;
        let ((s0, c0), (s1, c1)) = (sin_cos(self.heading), sin_cos(heading));
        let way = v(c0 - c1, 0.0, s1 - s0) / self.curvature;
        (self.start + way, heading)
    }

    /// Where each bone of somebody who carries `thing` is.
    fn bones(&self, time: f64, thing: Thing) -> [Place; BONES] {
        let (place, heading) = self.place(time);
        // A stride, two steps, is what the swing of the legs spans twice.
        let stride = 4.0 * (THIGH_LENGTH + SHIN_LENGTH) * self.height * sin(self.swing);
        let phase = self.phase + TAU * self.distance * time / stride;
        let (sine, cosine) = sin_cos(phase);
        let thighs = [self.swing * sine, -self.swing * sine];
        let lifted = |forwards: f64| 0.12 + 0.75 * forwards.max(0.0) * forwards.max(0.0);
        let knees = [lifted(cosine), lifted(-cosine)];
        // The foot that reaches deepest stands on the ground.
        let reach = [0, 1].map(|i| {
            let below = (SHIN_LENGTH + FOOT_HEIGHT) * cos(thighs[i] - knees[i]);
            THIGH_LENGTH * cos(thighs[i]) + below
        });
        let hips = reach[0].max(reach[1]);
        let root = turned(place, heading) * Place::from_scale(V::splat(self.height));
        let twist = 0.1 * sine;
        let torso = root * tilted(v(0.0, hips, 0.0), -twist, 0.05, 0.03 * cosine);
        let legs = root * turned(v(0.0, hips, 0.0), twist);
        let mut bones = [torso; BONES];
        bones[HEAD] = torso * turned(NECK, twist);
        for side in 0..2 {
            let x = if side == 0 { -1.0 } else { 1.0 };
            let both_hands = thing == Thing::Box;
            let holds = both_hands || (thing == Thing::Umbrella && side == 1);
            let [arm, elbow] = if holds {
                if both_hands { [0.35, 1.15] } else { [0.55, 1.7] }
            } else {
                [-0.85 * thighs[side], 0.3 - 0.35 * thighs[side].min(0.0)]
            };
            let shoulder = v(0.215 * x, 0.46, 0.0);
            let outwards = if holds { 0.05 } else { 0.12 };
            bones[UPPER_ARM + side] = torso * tilted(shoulder, 0.0, -arm, outwards * x);
            let down = |length: f64| v(0.0, -length, 0.0);
            bones[FOREARM + side] =
                bones[UPPER_ARM + side] * pitched(down(UPPER_ARM_LENGTH), -elbow);
            bones[THIGH + side] = legs * pitched(v(0.09 * x, 0.0, 0.0), -thighs[side]);
            bones[SHIN + side] = bones[THIGH + side] * pitched(down(THIGH_LENGTH), knees[side]);
        }
        bones
    }
}

/// Turned about x, then moved.
fn pitched(offset: V, angle: f64) -> Place {
    let (s, c) = sin_cos(angle);
    let about_x = DMat3::from_cols(V::X, v(0.0, c, s), v(0.0, -s, c));
    at(offset) * Place::from_mat3(about_x)
}

/// Everybody, in the order of their vertices.
#[derive(Debug)]
pub(super) struct Walkers {
    pub(super) models: Vec<Model>,
    pub(super) walkers: Vec<Walker>,
}

impl Pose for Walkers {
    fn pose(&self, time: f64, vertices: &mut [Vec3]) {
        let mut rest = vertices;
        let mut people = Vec::with_capacity(self.walkers.len());
        for walker in &self.walkers {
            let model = &self.models[walker.model];
            let (own, others) = rest.split_at_mut(model.vertices.len());
            people.push((walker, model, own));
            rest = others;
        }
        people.into_par_iter().for_each(|(walker, model, own)| {
            let bones = walker.bones(time, model.thing);
            for (bone, part) in &model.parts {
                let bone = bones[*bone];
                for (there, &p) in own[part.clone()].iter_mut().zip(&model.vertices[part.clone()]) {
                    *there = bone.transform_point3(p).as_vec3();
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_have_about_as_many_triangles_as_is_said() {
        let models = Model::all(0);
        let mean = models.iter().map(|m| m.triangles.len()).sum::<usize>() / models.len();
        assert!(mean.abs_diff(681) <= 7, "{mean} on the mean");
    }

    #[test]
    fn feet_stand_on_the_ground_and_go_no_deeper() {
        let models = Model::all(0);
        let mut rng = Rng::new(3, "feet");
        for _ in 0..50 {
            let start = v(rng.range(-9.0, 9.0), 0.0, rng.range(-9.0, 9.0));
            let walker = Walker::new(start, models.len(), 2.0, &mut rng);
            let model = &models[walker.model];
            for time in [0.0, 0.3, 0.9] {
                let mut vertices = vec![Vec3::ZERO; model.vertices.len()];
                let bones = walker.bones(time, model.thing);
                for (bone, part) in &model.parts {
                    for i in part.clone() {
                        vertices[i] = bones[*bone].transform_point3(model.vertices[i]).as_vec3();
                    }
                }
                let lowest = vertices.iter().map(|v| v.y).fold(f32::INFINITY, f32::min);
                assert!((-0.12..0.01).contains(&lowest), "{lowest} at {time} of {walker:?}");
                let middle = walker.place(time).0;
                let far = vertices.iter().map(|p| f64::from(p.x).abs());
                assert!(far.fold(0.0, f64::max) < middle.x.abs() + 1.3, "{walker:?}");
            }
        }
    }
}
