//! What each contender's tree takes: time on one thread and on all, and memory.

use super::workers::Workers;
use super::{is_embree, joined_notes};
use crate::Result;
use crate::backend::{BackendSpec, BuildStats};
use crate::bench::Subject;
use crate::geometry::TriangleMesh;
use crate::lab::Lab;
use crate::measure::{Summary, interleaved, ratios};
use serde::Serialize;

/// Building is steadier than answering, and takes longer.
const MOST_ROUNDS: usize = 5;

/// Keys that say how rays are answered: specs that differ in these alone are built alike.
const ANSWERING: [&str; 4] = ["trace", "mode", "width", "flags"];

/// One tree built on so many threads.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Row {
    pub(super) scene: String,
    pub(super) triangles: usize,
    pub(super) threads: usize,
    /// The spec without what concerns rays only.
    pub(super) backend: String,
    /// Tree and order, from the mesh to the first ray.
    pub(super) total_ms: f64,
    pub(super) total_ms_min: f64,
    pub(super) total_ms_max: f64,
    /// The order's part of it, in the last round.
    pub(super) order_ms: f64,
    /// How many times faster than Embree's medium quality, round by round.
    pub(super) ratio_to_medium: Option<f64>,
    pub(super) ratio_to_medium_min: Option<f64>,
    pub(super) ratio_to_medium_max: Option<f64>,
    /// Of the tree alone.
    pub(super) memory_bytes: u64,
    /// Vertices and indices, which all share.
    pub(super) mesh_bytes: u64,
    pub(super) memory_with_mesh_bytes: u64,
    /// Library, instruction set, flags.
    pub(super) notes: String,
}

/// Whose build time others are compared with.
const MEDIUM: &str = "embree:quality=medium";

/// The different trees of `contenders`.
pub(super) fn trees_of(contenders: &[BackendSpec]) -> Result<Vec<BackendSpec>> {
    let mut trees: Vec<BackendSpec> = Vec::new();
    for contender in contenders {
        let text = contender.to_string();
        let (name, settings) = text.split_once(':').unwrap_or((&text, ""));
        let of_tree = |setting: &&str| {
            let key = setting.split('=').next().unwrap_or_default();
            !setting.is_empty() && !ANSWERING.contains(&key)
        };
        let settings: Vec<&str> = settings.split(',').filter(of_tree).collect();
        let tree: BackendSpec = match settings.as_slice() {
            [] => name.parse()?,
            settings => format!("{name}:{}", settings.join(",")).parse()?,
        };
        if trees.iter().all(|t| t.full() != tree.full()) {
            trees.push(tree);
        }
    }
    Ok(trees)
}

/// Rounds of building, after a warm-up, where rays are answered in `rounds`.
pub(super) fn rounds(rounds: usize) -> usize {
    rounds.min(MOST_ROUNDS)
}

/// Builds each tree from nothing, in interleaved rounds.
pub(super) fn measured(
    subject: &Subject<'_>,
    trees: &[BackendSpec],
    workers: &Workers,
    step: &dyn Fn(),
) -> Result<Vec<Row>> {
    let (scene, settings) = (subject.scene(), subject.settings());
    let mut last = vec![BuildStats::default(); trees.len()];
    let mut failure = None;
    let times = interleaved(trees.len(), rounds(settings.rounds), |index| {
        // A lab of its own has no tree yet.
        let built = workers.run(|| {
            let built = Lab::new(scene, settings.seed).build(&trees[index])?;
            Ok(built.build_stats().clone())
        });
        step();
        match built {
            Ok(stats) => last[index] = stats,
            Err(error) => {
                failure.get_or_insert(error);
            }
        }
        last[index].build_ms + last[index].order_ms
    });
    if let Some(error) = failure {
        return Err(error);
    }
    let medium = trees.iter().position(|tree| is_embree(tree) && tree.to_string() == MEDIUM);
    let mesh_bytes = mesh_bytes(&scene.mesh);
    let row = |((tree, stats), times_ms): ((&BackendSpec, &BuildStats), &Vec<f64>)| {
        let total = Summary::of(times_ms);
        let ratio = medium.map(|medium| ratios(&times[medium], times_ms));
        Row {
            scene: scene.name.clone(),
            triangles: scene.mesh.len(),
            threads: workers.threads,
            backend: tree.to_string(),
            total_ms: total.median,
            total_ms_min: total.min,
            total_ms_max: total.max,
            order_ms: stats.order_ms,
            ratio_to_medium: ratio.map(|r| r.median),
            ratio_to_medium_min: ratio.map(|r| r.min),
            ratio_to_medium_max: ratio.map(|r| r.max),
            memory_bytes: stats.memory_bytes,
            mesh_bytes,
            memory_with_mesh_bytes: stats.memory_bytes + mesh_bytes,
            notes: joined_notes(stats),
        }
    };
    Ok(trees.iter().zip(&last).zip(&times).map(row).collect())
}

fn mesh_bytes(mesh: &TriangleMesh) -> u64 {
    (size_of_val(mesh.padded_vertices()) + size_of_val(mesh.triangles())) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::Settings;
    use crate::scene;

    fn specs(texts: &[&str]) -> Vec<BackendSpec> {
        texts.iter().map(|text| text.parse().unwrap()).collect()
    }

    #[test]
    fn specs_that_are_built_alike_are_built_once() {
        let contenders = specs(&[
            "bvh8",
            "bvh8:trace=single",
            "embree:quality=high",
            "embree:width=8,flags=coherent",
            "embree:quality=medium,width=16",
            "bvh8:builder=sweep,trace=stream",
            "kd",
        ]);
        let trees: Vec<String> =
            trees_of(&contenders).unwrap().iter().map(ToString::to_string).collect();
        let wanted =
            ["bvh8", "embree:quality=high", "embree:quality=medium", "bvh8:builder=sweep", "kd"];
        assert_eq!(trees, wanted);
        assert!(trees.contains(&MEDIUM.to_string()));
    }

    #[test]
    fn every_round_builds_anew_and_memory_is_the_structures() {
        let scene = scene::load("ship").unwrap();
        let settings = Settings { rounds: 2, size: [8, 8], spp: 1, seed: 0, backends: Vec::new() };
        let subject = Subject::new(&scene, &settings);
        let trees = specs(&["bvh8", "kd:order=node-sato"]);
        let steps = std::cell::Cell::new(0);
        for workers in Workers::one_and_all().unwrap() {
            steps.set(0);
            let rows =
                measured(&subject, &trees, &workers, &|| steps.set(steps.get() + 1)).unwrap();
            assert_eq!((rows.len(), steps.get()), (2, 2 * 3));
            for (row, tree) in rows.iter().zip(&trees) {
                let stats = subject.lab().build(tree).unwrap().build_stats().clone();
                assert_eq!(row.memory_bytes, stats.memory_bytes);
                assert_eq!(row.threads, workers.threads);
                assert!(row.total_ms_min > 0.0 && row.total_ms_min <= row.total_ms, "{row:?}");
                // Rounds that shared a tree would all say the same.
                assert!(row.total_ms_min < row.total_ms_max, "{row:?}");
                assert_eq!(row.ratio_to_medium, None);
                let mesh = 12 * (scene.mesh.vertices().len() + 1 + scene.mesh.len()) as u64;
                assert_eq!(row.memory_with_mesh_bytes, row.memory_bytes + mesh);
            }
        }
    }
}
