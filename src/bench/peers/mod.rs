//! Native backends beside Embree on the same rays: the benchmark of record.
//!
//! A cell is a scene, a class of rays, an arrangement of these rays in batches, and a number of
//! threads. In every cell all contenders answer the same batches in interleaved rounds. A native
//! contender's ratio to several configurations of Embree is the smallest of its ratios to each,
//! which are medians over pairs of one round: so Embree is always given its best configuration.

mod arrangement;
mod builds;
mod summary;
mod workers;

use super::{Experiment, ExperimentEntry, Settings, Subject};
use crate::backend::{Accelerator, BackendSpec, BuildStats};
use crate::measure::{Summary, interleaved, ratios, trace};
use crate::ray_set::{RaySet, occluded_count};
use crate::render::Pass;
use crate::results::Output;
use crate::{Error, Result};
use arrangement::ARRANGEMENTS;
use serde::Serialize;
use workers::Workers;

pub(super) static ENTRY: ExperimentEntry = ExperimentEntry {
    name: "peers",
    about: "shadow rays, build time and memory beside Embree's: the benchmark of record",
    of_the_paper: false,
    start: |settings| Box::new(Peers::new(settings)),
};

/// Who takes part, whatever is asked for besides. Answers are held against the first one's.
const CONTENDERS: [&str; 15] = [
    "bvh8",
    "bvh8:trace=single",
    "bvh8:trace=stream",
    "embree:quality=high,width=1,flags=incoherent",
    "embree:quality=high,width=1,flags=coherent",
    "embree:quality=high,width=8,flags=incoherent",
    "embree:quality=high,width=8,flags=coherent",
    "embree:quality=high,width=16,flags=incoherent",
    "embree:quality=high,width=16,flags=coherent",
    "embree:quality=medium,width=1,flags=incoherent",
    "embree:quality=medium,width=1,flags=coherent",
    "embree:quality=medium,width=8,flags=incoherent",
    "embree:quality=medium,width=8,flags=coherent",
    "embree:quality=medium,width=16,flags=incoherent",
    "embree:quality=medium,width=16,flags=coherent",
];

fn is_embree(spec: &BackendSpec) -> bool {
    spec.name() == "embree"
}

/// Whether it is high or medium quality, asked for single rays.
fn is_single_embree(spec: &BackendSpec) -> bool {
    is_embree(spec) && spec.value("width") == "1" && spec.value("quality") != "low"
}

fn joined_notes(stats: &BuildStats) -> String {
    stats.notes.join("; ")
}

/// One contender in one cell.
#[derive(Clone, Debug, Serialize)]
struct Row {
    scene: String,
    triangles: usize,
    rays: &'static str,
    arrangement: &'static str,
    threads: usize,
    backend: String,
    ray_count: usize,
    batch_count: usize,
    /// By this contender's answers.
    occluded_share: f64,
    /// Rays that the first contender answers otherwise.
    differing_rays: usize,
    trace_ms: f64,
    trace_ms_min: f64,
    trace_ms_max: f64,
    mrays_per_s: f64,
    /// How many times faster than the better of Embree's high and medium quality with single rays,
    /// round by round. None for Embree itself.
    ratio_to_single: Option<f64>,
    ratio_to_single_min: Option<f64>,
    ratio_to_single_max: Option<f64>,
    /// Which of them that is.
    single: Option<String>,
    /// Likewise, than the best of all Embree's configurations.
    ratio_to_best: Option<f64>,
    ratio_to_best_min: Option<f64>,
    ratio_to_best_max: Option<f64>,
    best: Option<String>,
    /// Library, instruction set, flags.
    notes: String,
}

struct Peers {
    settings: Settings,
    /// Those of the table, then those asked for.
    contenders: Vec<BackendSpec>,
    rows: Vec<Row>,
    builds: Vec<builds::Row>,
}

impl Peers {
    fn new(settings: &Settings) -> Self {
        let table = CONTENDERS.iter().map(|text| text.parse().expect("the table's specs exist"));
        let mut contenders: Vec<BackendSpec> = table.collect();
        for asked in &settings.backends {
            if contenders.iter().all(|contender| contender.full() != asked.full()) {
                contenders.push(asked.clone());
            }
        }
        Self::of(settings, contenders)
    }

    fn of(settings: &Settings, contenders: Vec<BackendSpec>) -> Self {
        Self { settings: settings.clone(), contenders, rows: Vec::new(), builds: Vec::new() }
    }

    /// Whether it must answer as the first contender does: native and of our choice. Embree has
    /// rules of its own, and so may what somebody asks for.
    fn must_agree(&self, contender: usize) -> bool {
        contender < CONTENDERS.len() && !is_embree(&self.contenders[contender])
    }

    /// Gives the rays of one cell to all.
    fn cell(
        &self,
        cell: &Cell<'_>,
        backends: &[Box<dyn Accelerator>],
        workers: &Workers,
        step: &dyn Fn(),
    ) -> Result<Vec<Row>> {
        let set = &cell.set;
        let mut answers = vec![set.no_answers(); backends.len()];
        let times = interleaved(backends.len(), self.settings.rounds, |index| {
            let (backend, answers) = (&*backends[index], &mut answers[index]);
            let ms = workers.run(|| trace(backend, set, answers));
            step();
            ms
        });
        let mut rows = Vec::new();
        for (index, contender) in self.contenders.iter().enumerate() {
            let differing_rays = set.differing(&answers[0], &answers[index]).len();
            if differing_rays > 0 && self.must_agree(index) {
                return Err(Error::CheckFailed(format!(
                    "{}, {} {}: {contender} and {} differ on {differing_rays} rays",
                    cell.scene, cell.rays, cell.arrangement, self.contenders[0]
                )));
            }
            let against = |of: fn(&BackendSpec) -> bool| {
                if is_embree(contender) { None } else { self.least_ratio(&times, index, of) }
            };
            let (single, best) = (against(is_single_embree), against(is_embree));
            let ms = Summary::of(&times[index]);
            rows.push(Row {
                scene: cell.scene.to_string(),
                triangles: cell.triangles,
                rays: cell.rays,
                arrangement: cell.arrangement,
                threads: workers.threads,
                backend: contender.to_string(),
                ray_count: set.len(),
                batch_count: set.batches().len(),
                occluded_share: occluded_count(&answers[index]) as f64 / set.len() as f64,
                differing_rays,
                trace_ms: ms.median,
                trace_ms_min: ms.min,
                trace_ms_max: ms.max,
                mrays_per_s: set.len() as f64 / (1e3 * ms.median),
                ratio_to_single: single.map(|(_, ratio)| ratio.median),
                ratio_to_single_min: single.map(|(_, ratio)| ratio.min),
                ratio_to_single_max: single.map(|(_, ratio)| ratio.max),
                single: single.map(|(of, _)| self.contenders[of].to_string()),
                ratio_to_best: best.map(|(_, ratio)| ratio.median),
                ratio_to_best_min: best.map(|(_, ratio)| ratio.min),
                ratio_to_best_max: best.map(|(_, ratio)| ratio.max),
                best: best.map(|(of, _)| self.contenders[of].to_string()),
                notes: joined_notes(backends[index].build_stats()),
            });
        }
        Ok(rows)
    }

    /// The configuration of Embree that a contender does worst against, and its ratio to that.
    fn least_ratio(
        &self,
        times: &[Vec<f64>],
        contender: usize,
        of: fn(&BackendSpec) -> bool,
    ) -> Option<(usize, Summary)> {
        let references = (0..times.len()).filter(|&index| of(&self.contenders[index]));
        let each = references.map(|index| (index, ratios(&times[index], &times[contender])));
        each.min_by(|(_, a), (_, b)| a.median.total_cmp(&b.median))
    }
}

/// The rays that all contenders are given, and what they are.
struct Cell<'a> {
    scene: &'a str,
    triangles: usize,
    rays: &'static str,
    arrangement: &'static str,
    set: RaySet,
}

impl Experiment for Peers {
    fn check(&self) -> Result<()> {
        for spec in &self.contenders {
            if let Some(why) = spec.entry().unavailable {
                let (backend, message) = (spec.name().to_string(), why.to_string());
                return Err(Error::Backend { backend, message });
            }
        }
        Ok(())
    }

    fn steps(&self) -> usize {
        let pools = if rayon::current_num_threads() == 1 { 1 } else { 2 };
        let trees = builds::trees_of(&self.contenders).map_or(0, |trees| trees.len());
        let builds = trees * (builds::rounds(self.settings.rounds) + 1);
        let cells = Pass::ALL.len() * ARRANGEMENTS.len();
        let answers = cells * self.contenders.len() * (self.settings.rounds + 1);
        self.contenders.len() + pools * (builds + answers)
    }

    fn measure(&mut self, subject: &Subject<'_>, step: &dyn Fn()) -> Result<()> {
        let recording = subject.recording()?;
        let pools = Workers::one_and_all()?;
        let trees = builds::trees_of(&self.contenders)?;
        for workers in &pools {
            self.builds.extend(builds::measured(subject, &trees, workers, step)?);
        }
        let mut backends = Vec::new();
        for contender in &self.contenders {
            backends.push(subject.lab().build(contender)?);
            step();
        }
        let passes = recording.passes().iter().enumerate();
        for (index, pass) in passes.filter(|(_, pass)| !pass.rays().is_empty()) {
            for arrangement in &ARRANGEMENTS {
                let cell = Cell {
                    scene: &subject.scene().name,
                    triangles: subject.scene().mesh.len(),
                    rays: pass.pass().name(),
                    arrangement: arrangement.name,
                    set: (arrangement.arrange)(recording, index, self.settings.seed),
                };
                for workers in &pools {
                    let rows = self.cell(&cell, &backends, workers, step)?;
                    self.rows.extend(rows);
                }
            }
        }
        Ok(())
    }

    fn finish(&self, output: &mut Output) -> Result<String> {
        summary::finish(output, &self.rows, &self.builds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::{Hit, Ray, RayBatch};
    use std::time::Duration;

    /// Answers as told, after as long as told.
    struct Actor {
        milliseconds: u64,
        occluded: u64,
        stats: BuildStats,
    }

    impl Accelerator for Actor {
        fn build_stats(&self) -> &BuildStats {
            &self.stats
        }

        fn closest_hit(&self, _: &Ray) -> Option<Hit> {
            None
        }

        fn occluded(&self, _: &RayBatch<'_>, occluded: &mut [u64]) {
            std::thread::sleep(Duration::from_millis(self.milliseconds));
            occluded[0] = self.occluded;
        }
    }

    /// The rows of contenders by spec, time and answers to three rays.
    fn play(cast: &[(&str, u64, u64)]) -> Result<Vec<Row>> {
        let settings = Settings { rounds: 3, size: [8, 8], spp: 1, seed: 0, backends: Vec::new() };
        let specs = cast.iter().map(|actor| actor.0.parse().unwrap()).collect();
        let backends: Vec<Box<dyn Accelerator>> = cast
            .iter()
            .map(|&(_, milliseconds, occluded)| {
                let stats = BuildStats::default();
                Box::new(Actor { milliseconds, occluded, stats }) as Box<dyn Accelerator>
            })
            .collect();
        let mut set = RaySet::default();
        set.push_batch(&[Ray::new(glam::Vec3::ZERO, glam::Vec3::X, 1.0); 3]);
        let cell = Cell { scene: "stage", triangles: 0, rays: "ao", arrangement: "tiles", set };
        let workers = &Workers::one_and_all()?[0];
        Peers::of(&settings, specs).cell(&cell, &backends, workers, &|| ())
    }

    #[test]
    fn embree_is_given_its_best() {
        let rows = play(&[
            ("bvh8", 2, 0b101),
            ("embree:quality=high", 36, 0b101),
            ("embree:quality=medium", 12, 0b101),
            ("embree:quality=low", 6, 0b101),
            ("embree:quality=high,width=8", 4, 0b101),
            ("embree:quality=high,width=16", 20, 0b101),
        ])
        .unwrap();
        // Of high and medium quality with single rays, and of all.
        assert_eq!(rows[0].single.as_deref(), Some("embree:quality=medium"));
        assert_eq!(rows[0].best.as_deref(), Some("embree:quality=high,width=8"));
        let (single, best) = (rows[0].ratio_to_single.unwrap(), rows[0].ratio_to_best.unwrap());
        assert!(single > best && best > 1.0, "{single} {best}");
        assert!(rows[1..].iter().all(|row| row.best.is_none() && row.ratio_to_single.is_none()));
        assert!(rows.iter().all(|row| (row.occluded_share - 2.0 / 3.0).abs() < 1e-12));
    }

    #[test]
    fn other_answers_are_counted_of_embree_and_refused_of_native_contenders() {
        let rows = play(&[("bvh8", 0, 0b101), ("embree", 0, 0b110)]).unwrap();
        assert_eq!((rows[0].differing_rays, rows[1].differing_rays), (0, 2));
        let error = play(&[("bvh8", 0, 0b101), ("bvh8:trace=single", 0, 0b111)]).unwrap_err();
        assert_eq!(error.exit_status(), 3);
        let wanted = "stage, ao tiles: bvh8:trace=single and bvh8 differ on 1 rays";
        assert_eq!(error.to_string(), wanted);
    }

    #[test]
    fn contenders_asked_for_are_added_once() {
        let backends = ["kd", "bvh8:trace=auto", "embree:width=8"].map(|b| b.parse().unwrap());
        let settings =
            Settings { rounds: 1, size: [8, 8], spp: 1, seed: 0, backends: backends.to_vec() };
        let peers = Peers::new(&settings);
        let added: Vec<String> =
            peers.contenders[CONTENDERS.len()..].iter().map(ToString::to_string).collect();
        assert_eq!(added, ["kd"]);
        assert!(peers.must_agree(2) && !peers.must_agree(3) && !peers.must_agree(15));
        assert_eq!(peers.check().is_ok(), cfg!(feature = "embree"));
    }
}
