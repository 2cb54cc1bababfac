//! Gathers the motion of a scene's parts while its mesh is put together.

use super::mesh_builder::{MAX_COORDINATE, MeshPart};
use super::motion::{Motion, Object, Pose};
use super::pose::{KeyFrames, Placed, Rest, TransformKeys};
use crate::geometry::Vec3;
use glam::{DAffine3, DVec3};
use std::ops::Range;

/// Frames of a scene that moves, when neither it nor what moves says how many.
const DEFAULT_FRAMES: usize = 20;

/// How far from the origin, on each axis, a generator's vertices ever get.
pub(super) const GENERATED_REACH: f64 = 1e5;

/// How the vertices of a part move before it is transformed.
#[derive(Debug)]
pub(super) enum LocalMotion {
    /// They do not.
    Still,
    /// From key to key; the first key is where the part has them.
    Keys(Vec<Vec<Vec3>>),
    /// As their generator says, in the part's own indices.
    Own(Motion),
}

/// What has been gathered so far.
#[derive(Debug, Default)]
pub(super) struct MotionBuilder {
    vertices: usize,
    triangles: usize,
    objects: Vec<Object>,
    poses: Vec<(Range<usize>, Box<dyn Pose>)>,
    /// Keys of the longest sequence.
    most_keys: Option<usize>,
    /// Most frames of a moving generator.
    most_frames: Option<usize>,
}

impl MotionBuilder {
    /// Adds the motion of `part`, which consists of `objects` (whether they move is seen to here), is
    /// transformed by `keys`, then by `placement`. Returns the transform of the first frame, which is
    /// the one to give the mesh.
    ///
    /// The error says what is wrong with where vertices get.
    pub(super) fn append(
        &mut self,
        part: &MeshPart,
        objects: Vec<Object>,
        local: LocalMotion,
        keys: Option<TransformKeys>,
        placement: DAffine3,
    ) -> Result<DAffine3, String> {
        let first = match &keys {
            Some(keys) => placement * keys.at(0.0),
            None => placement,
        };
        let turns = keys.as_ref().is_some_and(TransformKeys::moves);
        let (local, mut objects) = of_its_own(local, objects);
        objects.iter_mut().for_each(|object| object.moves |= turns);
        if objects.iter().any(|object| object.moves) {
            check_reach(extent(part, &local), keys.as_ref(), &placement)?;
            self.add_poses(part, local, keys, placement);
        }
        let (vertices, triangles) = (self.vertices, self.triangles);
        let moved = |range: Range<usize>, by: usize| range.start + by..range.end + by;
        self.objects.extend(objects.into_iter().map(|object| Object {
            vertices: moved(object.vertices, vertices),
            triangles: moved(object.triangles, triangles),
            moves: object.moves,
        }));
        self.vertices += part.vertices.len();
        self.triangles += part.triangles.len();
        Ok(first)
    }

    fn add_poses(
        &mut self,
        part: &MeshPart,
        local: LocalMotion,
        keys: Option<TransformKeys>,
        placement: DAffine3,
    ) {
        let mut locals: Vec<(Range<usize>, Box<dyn Pose>)> = Vec::new();
        let all = 0..part.vertices.len();
        match local {
            LocalMotion::Still => locals.push((all, Box::new(Rest(part.vertices.clone())))),
            LocalMotion::Keys(frames) => {
                self.most_keys = self.most_keys.max(Some(frames.len()));
                locals.push((all, Box::new(KeyFrames(frames))));
            }
            LocalMotion::Own(motion) => {
                self.most_frames = self.most_frames.max(Some(motion.frames));
                locals = motion.poses;
                if keys.is_some() {
                    add_rest(part, &mut locals);
                }
            }
        }
        let first = self.vertices;
        self.poses.extend(locals.into_iter().map(|(range, local)| {
            let range = range.start + first..range.end + first;
            let pose = if keys.is_none() && placement == DAffine3::IDENTITY {
                local
            } else {
                Box::new(Placed { local, keys: keys.clone(), placement })
            };
            (range, pose)
        }));
    }

    /// The motion of all parts over `frames`, or as many as suit them; `None` if nothing moves.
    pub(super) fn finish(self, frames: Option<usize>) -> Option<Motion> {
        let suited = self.most_keys.or(self.most_frames).unwrap_or(DEFAULT_FRAMES);
        let frames = frames.unwrap_or(suited);
        let Self { objects, poses, .. } = self;
        (!poses.is_empty()).then_some(Motion { frames, objects, poses })
    }
}

/// `objects` as they move by `local` alone.
fn of_its_own(local: LocalMotion, mut objects: Vec<Object>) -> (LocalMotion, Vec<Object>) {
    match local {
        LocalMotion::Still => (LocalMotion::Still, objects),
        LocalMotion::Keys(frames) => {
            for object in &mut objects {
                let there = |frame: &[Vec3]| -> Vec<_> {
                    let vertices = frame[object.vertices.clone()].iter();
                    vertices.map(|v| v.to_array().map(f32::to_bits)).collect()
                };
                let at_first = there(&frames[0]);
                object.moves = frames.iter().any(|frame| there(frame) != at_first);
            }
            (LocalMotion::Keys(frames), objects)
        }
        LocalMotion::Own(Motion { frames, objects, poses }) => {
            (LocalMotion::Own(Motion { frames, objects: Vec::new(), poses }), objects)
        }
    }
}

/// Poses for the vertices of `part` that `poses` leave alone.
fn add_rest(part: &MeshPart, poses: &mut Vec<(Range<usize>, Box<dyn Pose>)>) {
    poses.sort_by_key(|(range, _)| range.start);
    let starts = [0].into_iter().chain(poses.iter().map(|(range, _)| range.end));
    let ends = poses.iter().map(|(range, _)| range.start).chain([part.vertices.len()]);
    let gaps = starts.zip(ends).filter(|(start, end)| start < end);
    let rest: Vec<(Range<usize>, Box<dyn Pose>)> = gaps
        .map(|(start, end)| {
            let rest: Box<dyn Pose> = Box::new(Rest(part.vertices[start..end].to_vec()));
            (start..end, rest)
        })
        .collect();
    poses.extend(rest);
}

/// How far the vertices get from the origin on each axis before they are transformed.
fn extent(part: &MeshPart, local: &LocalMotion) -> DVec3 {
    let of = |vertices: &[Vec3]| vertices.iter().fold(Vec3::ZERO, |most, v| most.max(v.abs()));
    match local {
        LocalMotion::Still => of(&part.vertices).as_dvec3(),
        // Between keys they lie between those of the keys.
        LocalMotion::Keys(frames) => {
            frames.iter().map(|frame| of(frame)).fold(Vec3::ZERO, Vec3::max).as_dvec3()
        }
        LocalMotion::Own(_) => DVec3::splat(GENERATED_REACH),
    }
}

/// Whether all points within `extent` of the origin stay in range at all times, on the safe side.
fn check_reach(
    extent: DVec3,
    keys: Option<&TransformKeys>,
    placement: &DAffine3,
) -> Result<(), String> {
    let rows = placement.matrix3.transpose();
    let rows = [rows.x_axis, rows.y_axis, rows.z_axis];
    let there = DVec3::from_array(match keys {
        // A ball of that radius.
        Some(keys) => rows.map(|row| row.length() * keys.reach(extent.length())),
        // A box, which a transform of its own kind keeps within these.
        None => rows.map(|row| row.abs().dot(extent)),
    }) + placement.translation.abs();
    // False for what is not a number too.
    if there.cmple(DVec3::splat(f64::from(MAX_COORDINATE))).all() {
        Ok(())
    } else {
        Err(format!("a vertex may move beyond {MAX_COORDINATE:e}"))
    }
}
