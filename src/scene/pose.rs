//! Poses of what scene files put together: key frames, and transforms that change with time.

use super::motion::Pose;
use super::transform;
use crate::geometry::Vec3;
use glam::{DAffine3, DVec3};
use rayon::prelude::*;

/// Vertices posed at a time on one thread.
const CHUNK: usize = 1 << 12;

/// How near to a key, in distances between keys, a time counts as the key's: what rounding makes of
/// the time of a frame, and nothing that shows.
const AT_KEY: f64 = 1e-9;

/// Which of `count` keys, evenly spread from time 0 to 1, `time` follows, and how far on it is to the
/// next one: from 0 to below 1.
fn between_keys(time: f64, count: usize) -> (usize, f64) {
    let last = (count - 1) as f64;
    let place = (time * last).clamp(0.0, last);
    let nearest = place.round();
    if (place - nearest).abs() < AT_KEY {
        (nearest as usize, 0.0)
    } else {
        (place as usize, place.fract())
    }
}

/// Vertices that stay where they are.
#[derive(Debug)]
pub(super) struct Rest(pub(super) Vec<Vec3>);

impl Pose for Rest {
    fn pose(&self, _: f64, vertices: &mut [Vec3]) {
        vertices.copy_from_slice(&self.0);
    }
}

/// All vertices at each of some times, evenly spread from the first frame to the last; they go
/// straight from one key to the next. At least one key.
#[derive(Debug)]
pub(super) struct KeyFrames(pub(super) Vec<Vec<Vec3>>);

impl Pose for KeyFrames {
    fn pose(&self, time: f64, vertices: &mut [Vec3]) {
        let (key, on) = between_keys(time, self.0.len());
        let from = &self.0[key];
        if on == 0.0 {
            vertices.copy_from_slice(from);
            return;
        }
        let chunks = from.par_chunks(CHUNK).zip(self.0[key + 1].par_chunks(CHUNK));
        vertices.par_chunks_mut(CHUNK).zip(chunks).for_each(|(vertices, (from, to))| {
            for (vertex, (from, to)) in vertices.iter_mut().zip(from.iter().zip(to)) {
                // Equal ends give themselves.
                *vertex = (from.as_dvec3() * (1.0 - on) + to.as_dvec3() * on).as_vec3();
            }
        });
    }
}

/// Scale, rotation and translation at one time; see [`transform::from_parts`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TransformKey {
    /// From 0 at the first frame to 1 at the last.
    pub(super) time: f64,
    pub(super) scale: DVec3,
    pub(super) rotate_degrees: DVec3,
    pub(super) translate: DVec3,
}

impl TransformKey {
    fn parts(&self) -> [DVec3; 3] {
        [self.translate, self.rotate_degrees, self.scale]
    }

    pub(super) fn transform(&self) -> DAffine3 {
        transform::from_parts(self.translate, self.rotate_degrees, self.scale)
    }
}

/// A transform whose numbers go straight from one key to the next; before the first key it is the
/// first, after the last the last. Keys are finite, their times strictly increase; at least one.
#[derive(Clone, Debug)]
pub(super) struct TransformKeys(pub(super) Vec<TransformKey>);

impl TransformKeys {
    pub(super) fn at(&self, time: f64) -> DAffine3 {
        let keys = &self.0;
        let next = keys.partition_point(|key| key.time <= time);
        if next == 0 || next == keys.len() {
            return keys[next.saturating_sub(1)].transform();
        }
        let (from, to) = (&keys[next - 1], &keys[next]);
        let on = (time - from.time) / (to.time - from.time);
        let (from, to) = (from.parts(), to.parts());
        let [translate, rotate, scale] = [0, 1, 2].map(|i| from[i] * (1.0 - on) + to[i] * on);
        transform::from_parts(translate, rotate, scale)
    }

    /// Whether it ever changes.
    pub(super) fn moves(&self) -> bool {
        self.0.iter().any(|key| key.parts() != self.0[0].parts())
    }

    /// A bound on the length of any point within `radius` of the origin that it is applied to.
    ///
    /// Scales and translations lie between those of keys, and turning changes no length.
    pub(super) fn reach(&self, radius: f64) -> f64 {
        let most = |length: fn(&TransformKey) -> f64| self.0.iter().map(length).fold(0.0, f64::max);
        radius * most(|key| key.scale.abs().max_element()) + most(|key| key.translate.length())
    }
}

/// A pose in coordinates of its own, then transformed.
#[derive(Debug)]
pub(super) struct Placed {
    pub(super) local: Box<dyn Pose>,
    /// Applied first.
    pub(super) keys: Option<TransformKeys>,
    pub(super) placement: DAffine3,
}

impl Pose for Placed {
    fn pose(&self, time: f64, vertices: &mut [Vec3]) {
        self.local.pose(time, vertices);
        let placement = match &self.keys {
            Some(keys) => self.placement * keys.at(time),
            None => self.placement,
        };
        // As scenes are put together: the identity does not touch a bit.
        if placement != DAffine3::IDENTITY {
            vertices.par_chunks_mut(CHUNK).for_each(|vertices| {
                vertices.iter_mut().for_each(|v| *v = transform::point(&placement, *v));
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_at_keys_are_the_keys_and_others_lie_between() {
        let keys: Vec<Vec<Vec3>> =
            (0..10).map(|k| vec![Vec3::new(k as f32 * 0.1, -0.0, 1e-42), Vec3::ONE]).collect();
        let pose = KeyFrames(keys.clone());
        let at = |time: f64| {
            let mut vertices = vec![Vec3::NAN; 2];
            pose.pose(time, &mut vertices);
            vertices
        };
        let bits = |vertices: &[Vec3]| -> Vec<_> {
            vertices.iter().map(|v| v.to_array().map(f32::to_bits)).collect()
        };
        for (k, key) in keys.iter().enumerate() {
            assert_eq!(bits(&at(k as f64 / 9.0)), bits(key), "key {k}");
            // The same times among more frames.
            assert_eq!(bits(&at((k * 11) as f64 / 99.0)), bits(key), "key {k}");
        }
        assert!((at(1.5 / 9.0)[0].x - 0.15).abs() < 1e-6);
        assert_eq!(bits(&at(0.7))[1], bits(&keys[0])[1]);
        assert_eq!(at(2.0), keys[9]);
    }

    fn key(time: f64, turn: f64, x: f64) -> TransformKey {
        let (rotate_degrees, translate) = (DVec3::new(0.0, turn, 0.0), DVec3::X * x);
        TransformKey { time, scale: DVec3::ONE, rotate_degrees, translate }
    }

    #[test]
    fn transforms_turn_as_far_as_their_numbers_say() {
        let keys = TransformKeys(vec![key(0.25, 0.0, 0.0), key(0.75, 360.0, 8.0)]);
        let there = |time| keys.at(time).transform_point3(DVec3::Z);
        let near = |a: DVec3, b: DVec3| assert!((a - b).length() < 1e-12, "{a} is not {b}");
        near(there(0.0), DVec3::Z);
        near(there(0.25), DVec3::Z);
        near(there(0.375), DVec3::new(3.0, 0.0, 0.0));
        near(there(0.5), DVec3::new(4.0, 0.0, -1.0));
        near(there(1.0), DVec3::new(8.0, 0.0, 1.0));
        assert!(keys.moves() && !TransformKeys(vec![key(0.0, 9.0, 1.0); 2]).moves());
    }

    #[test]
    fn nothing_reaches_beyond_the_bound() {
        let mut random = crate::test_random::Random::new(5);
        for _ in 0..200 {
            let mut number = |most: f64| (f64::from(random.unit()) * 2.0 - 1.0) * most;
            let mut three = |most| DVec3::new(number(most), number(most), number(most));
            let keys = TransformKeys(
                [0.0, 0.3, 1.0]
                    .map(|time| TransformKey {
                        time,
                        scale: three(3.0),
                        rotate_degrees: three(720.0),
                        translate: three(5.0),
                    })
                    .into(),
            );
            let (point, time) = (three(2.0), f64::from(random.unit()));
            let length = keys.at(time).transform_point3(point).length();
            assert!(length <= keys.reach(point.length()) * (1.0 + 1e-12), "{keys:?} {point}");
        }
    }
}
