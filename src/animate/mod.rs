//! Moving scenes, frame by frame: what following the triangles takes beside what tracing takes. What
//! `sato animate` runs.
//!
//! The first frame is what backends are built for. In each later one all of them are brought up to
//! date, in turns that go round, and answer the same recorded rays; the first backend's answers make
//! the picture. What counts as a frame is the update and the first answering of the rays: that is when
//! backends that build on demand build, so nothing may ask them before: camera rays go through a tree
//! that nobody is measured by.

mod charts;
mod rows;
mod text;

pub use rows::{AnimateReport, FrameRow, TotalRow};
pub use text::animate_text;

use crate::backend::{Accelerator, BackendSpec, MovingAccelerator, UpdateStats};
use crate::geometry::TriangleMesh;
use crate::image_file::{ToneCurve, tone_map_by, write_exr, write_png};
use crate::lab::Lab;
use crate::measure::{Summary, interleaved, trace};
use crate::ray_set::occluded_count;
use crate::render::{Film, Recording, RenderSettings, record};
use crate::report::{BackendReport, Provenance, SceneReport, write_json};
use crate::results::Output;
use crate::scene::{Motion, Scene};
use crate::{Error, Result};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// What to run, and where the results go.
#[derive(Clone, Debug)]
pub struct Plan {
    /// What follows the scene; at least one. The first makes the pictures, and is what others are held
    /// against.
    pub backends: Vec<BackendSpec>,
    /// Frames of the scene's motion, at least two.
    pub frames: Range<usize>,
    /// What is recorded in each frame.
    pub render: RenderSettings,
    /// Timed rounds of tracing in each frame, after the one that counts for it; at least 1.
    pub rounds: usize,
    /// Whether to ask how good trees are, which may build new ones to compare with.
    pub quality: bool,
    /// Facts for the files of the pictures, if there are to be any.
    pub pictures: Option<Vec<(String, String)>>,
    /// The folder for the results.
    pub folder: PathBuf,
}

/// What answers camera rays: quick to follow, as it builds on demand.
const RECORDER: &str = "lazy";

/// Told how many steps are done, and of how many.
pub type Progress<'a> = &'a dyn Fn(usize, usize);

impl Plan {
    /// # Errors
    /// [`Error::Usage`] of a scene that does not move and of frames that it has not.
    fn motion<'a>(&self, scene: &'a Scene) -> Result<&'a Motion> {
        let name = &scene.name;
        let Some(motion) = &scene.motion else {
            return Err(Error::Usage(format!(
                "scene {name} does not move: `sato animate` takes a scene file that says how its \
                 geometry moves, or a generator that does (see `sato list`)"
            )));
        };
        let Range { start, end } = self.frames;
        let most = motion.frames;
        if end > most {
            return Err(Error::Usage(format!(
                "frames {start}..{end}: scene {name} has {most}, from 0 to {}",
                most - 1
            )));
        }
        if end < start.saturating_add(2) {
            return Err(Error::Usage(format!(
                "frames {start}..{end}: at least two are needed; trees are built for the first"
            )));
        }
        Ok(motion)
    }

    fn check(&self) -> Result<()> {
        if self.rounds == 0 || self.backends.is_empty() {
            return Err(Error::Usage("at least one backend and one round are needed".into()));
        }
        let names: Vec<String> = self.backends.iter().map(ToString::to_string).collect();
        match names.iter().enumerate().find(|(at, name)| names[..*at].contains(name)) {
            Some((_, twice)) => Err(Error::Usage(format!("backend '{twice}' is given twice"))),
            None => self.render.check(),
        }
    }
}

/// Follows the scene's motion on the current rayon pool. The folder then holds `animate.json` with
/// every row, `report.txt`, `frames.csv`, `totals.csv`, charts over the frames and, if there are to be
/// pictures, `frames/frame_0000.exr` and `.png` of each frame.
///
/// # Errors
/// A scene that does not move, frames that it has not, a backend that this build lacks or that fails,
/// rays that nothing needs, a file that cannot be written. Pictures are written as they come, all else
/// when all is measured.
pub fn run(scene: &Scene, plan: &Plan, progress: Progress<'_>) -> Result<AnimateReport> {
    plan.check()?;
    let motion = plan.motion(scene)?;
    let seed = plan.render.seed;
    let at = |frame| Arc::new(motion.mesh_at(&scene.mesh, frame));
    let mut scene = Scene { mesh: at(plan.frames.start), ..scene.clone() };
    let count = plan.backends.len();
    let total = count * (1 + plan.frames.len());
    let mut followers = Vec::new();
    for spec in &plan.backends {
        // Each has its own trees, as it will change them.
        followers.push(Lab::new(&scene, seed).build_moving(spec)?);
        progress(followers.len(), total);
    }
    // Better now than after the measuring.
    std::fs::create_dir_all(&plan.folder).map_err(Error::io(&plan.folder))?;
    let mut recorder = Lab::new(&scene, seed).build_moving(&RECORDER.parse()?)?;
    let contenders: Vec<&dyn Accelerator> = followers.iter().map(|f| f.accelerator()).collect();
    let backends = BackendReport::all(&plan.backends, &contenders);
    let mut rows = Vec::new();
    let mut files = Vec::new();
    // The first frame's for all: a film is not to flicker.
    let mut curve: Option<ToneCurve> = None;
    for (place, frame) in plan.frames.clone().enumerate() {
        // Whoever drops a frame's mesh last is not to be the one that is timed.
        let last = (place > 0).then(|| std::mem::replace(&mut scene.mesh, at(frame)));
        let turns = turns(place, count);
        let updates = match place {
            0 => built(&backends),
            _ => update(&mut followers, &turns, &scene.mesh)?,
        };
        if place > 0 {
            recorder.update(Arc::clone(&scene.mesh))?;
        }
        drop(last);
        let recording = record(&scene, recorder.accelerator(), &plan.render, None)?;
        let traced = trace_all(&followers, &turns, &recording, plan.rounds);
        for (index, (update_ms, update)) in updates.into_iter().enumerate() {
            followers[index].traced(traced[index].first_ms);
            let quality = plan.quality.then(|| followers[index].quality());
            let backend = &backends[index].spec;
            rows.push(FrameRow::new(frame, backend, update_ms, &update, &traced[index], quality));
        }
        if let Some(facts) = &plan.pictures {
            let film = recording.film(&traced[0].answers, None);
            let curve = curve.get_or_insert_with(|| ToneCurve::of_film(&film));
            let mut metadata = plan.render.metadata();
            metadata.extend_from_slice(facts);
            files.extend(write_picture(&plan.folder, frame, &film, curve, metadata)?);
        }
        progress(count * (2 + place), total);
    }
    if rows.iter().all(|row| row.rays == 0) {
        let message = "in no frame does a camera ray hit anything that needs a shadow ray";
        return Err(Error::Usage(format!("scene {}: {message}", scene.name)));
    }
    let totals = TotalRow::all(&backends, &rows, plan.frames.start);
    let mut output = Output::new(plan.folder.clone(), std::slice::from_ref(&scene.name));
    output.rows("frames", &rows)?;
    output.rows("totals", &totals)?;
    charts::write(&mut output, &scene.name, plan, &backends, &rows, &totals)?;
    let mut report = AnimateReport {
        provenance: Provenance::new(rayon::current_num_threads(), seed),
        scene: SceneReport::new(&scene),
        objects: motion.objects.len(),
        moving_objects: motion.objects.iter().filter(|object| object.moves).count(),
        frames: [plan.frames.start, plan.frames.end],
        rounds: plan.rounds,
        size: plan.render.size,
        spp: plan.render.spp,
        camera_samples: plan.render.camera_samples,
        passes: plan.render.passes.iter().map(|pass| pass.name()).collect(),
        backends,
        rows,
        totals,
        files: Vec::new(),
    };
    output.write_text("report.txt", &animate_text(&report))?;
    files.extend(output.into_record().1);
    report.files = files;
    write_json(&plan.folder.join("animate.json"), &report)?;
    Ok(report)
}

/// Who goes first in a frame, and who follows.
fn turns(place: usize, count: usize) -> Vec<usize> {
    (0..count).map(|turn| (turn + place) % count).collect()
}

/// What building took, in milliseconds, as if it were an update.
fn built(backends: &[BackendReport]) -> Vec<(f64, UpdateStats)> {
    let one = |backend: &BackendReport| {
        let (build_ms, order_ms) = (backend.build.build_ms, backend.build.order_ms);
        let stats = UpdateStats { build_ms, order_ms, rebuilt: true, ..UpdateStats::default() };
        (stats.total_ms(), stats)
    };
    backends.iter().map(one).collect()
}

/// Brings all backends up to date, in turn: the whole time of each, in milliseconds, and what it says
/// of it.
fn update(
    followers: &mut [Box<dyn MovingAccelerator>],
    turns: &[usize],
    mesh: &Arc<TriangleMesh>,
) -> Result<Vec<(f64, UpdateStats)>> {
    let mut updates = vec![(0.0, UpdateStats::default()); followers.len()];
    for &index in turns {
        let mesh = Arc::clone(mesh);
        let start = Instant::now();
        let stats = followers[index].update(mesh)?;
        updates[index] = (start.elapsed().as_secs_f64() * 1e3, stats);
    }
    Ok(updates)
}

/// What one backend makes of a frame's rays.
struct Traced {
    /// Time to answer all rays of all passes for the first time, in milliseconds.
    first_ms: f64,
    /// The same in later rounds.
    trace_ms: Summary,
    /// By pass.
    answers: Vec<Vec<u64>>,
    rays: u64,
    occluded: u64,
    /// Rays that the first backend answers differently.
    differing: u64,
}

fn trace_all(
    followers: &[Box<dyn MovingAccelerator>],
    turns: &[usize],
    recording: &Recording,
    rounds: usize,
) -> Vec<Traced> {
    let sets: Vec<_> = recording.passes().iter().map(|pass| pass.rays()).collect();
    let none: Vec<_> = sets.iter().map(|set| set.no_answers()).collect();
    let mut answers = vec![none; followers.len()];
    let mut first = vec![None; followers.len()];
    let in_turn = interleaved(turns.len(), rounds, |turn| {
        let index = turns[turn];
        let accelerator = followers[index].accelerator();
        let passes = sets.iter().zip(&mut answers[index]);
        let ms = passes.map(|(set, answers)| trace(accelerator, set, answers)).sum();
        first[index].get_or_insert(ms);
        ms
    });
    let mut summaries: Vec<(usize, Summary)> =
        turns.iter().zip(&in_turn).map(|(&index, ms)| (index, Summary::of(ms))).collect();
    summaries.sort_by_key(|summary| summary.0);
    let rays = sets.iter().map(|set| set.len() as u64).sum();
    let differing: Vec<u64> = answers
        .iter()
        .map(|own| {
            let passes = sets.iter().zip(answers[0].iter().zip(own));
            passes.map(|(set, (first, own))| set.differing(first, own).len() as u64).sum()
        })
        .collect();
    summaries
        .into_iter()
        .zip(answers)
        .zip(differing)
        .map(|(((index, trace_ms), answers), differing)| Traced {
            first_ms: first[index].expect("every backend has a turn"),
            trace_ms,
            rays,
            occluded: answers.iter().map(|words| occluded_count(words) as u64).sum(),
            answers,
            differing,
        })
        .collect()
}

/// Writes a frame's picture, and returns its files' names in the folder.
fn write_picture(
    folder: &Path,
    frame: usize,
    film: &Film,
    curve: &ToneCurve,
    mut metadata: Vec<(String, String)>,
) -> Result<[String; 2]> {
    metadata.push(("sato:frame".into(), frame.to_string()));
    let names = ["exr", "png"].map(|extension| format!("frames/frame_{frame:04}.{extension}"));
    write_exr(&folder.join(&names[0]), film, &metadata)?;
    write_png(&folder.join(&names[1]), &tone_map_by(film, curve))?;
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everybody_goes_first_and_last_as_often() {
        for count in 1..5 {
            let orders: Vec<_> = (0..count).map(|place| turns(place, count)).collect();
            for turn in 0..count {
                let mut backends: Vec<usize> = orders.iter().map(|order| order[turn]).collect();
                backends.sort_unstable();
                assert_eq!(backends, (0..count).collect::<Vec<_>>());
            }
        }
    }
}
