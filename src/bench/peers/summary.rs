//! Geometric means and least cells, as records, text and charts.

use super::arrangement::ARRANGEMENTS;
use super::{ENTRY, Row, builds};
use crate::Result;
use crate::bench::distinct;
use crate::chart::{Axis, Bars, Better, Body, Group, HeatTable};
use crate::measure::geometric_mean;
use crate::report::table;
use crate::results::Output;
use serde::Serialize;
use std::fmt::Write;

/// What native contenders are compared with.
struct Reference {
    /// In names of files.
    name: &'static str,
    about: &'static str,
    ratio: fn(&Row) -> Option<f64>,
}

const REFERENCES: [Reference; 2] = [
    Reference {
        name: "single",
        about: "the better of Embree's high and medium quality with single rays",
        ratio: |row| row.ratio_to_single,
    },
    Reference {
        name: "best",
        about: "the best of Embree's configurations in each cell",
        ratio: |row| row.ratio_to_best,
    },
];

/// The mean over some cells, and the least of them.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Mean {
    reference: &'static str,
    /// None: of any number.
    threads: Option<usize>,
    /// An arrangement, a class of rays, or `all`.
    group: String,
    backend: String,
    cells: usize,
    /// Geometric.
    ratio: f64,
    least_ratio: f64,
    least_cell: String,
}

/// Tables, charts and text of everything.
pub(super) fn finish(output: &mut Output, rows: &[Row], builds: &[builds::Row]) -> Result<String> {
    let means = means(rows);
    output.rows(ENTRY.name, rows)?;
    output.rows(&format!("{}-builds", ENTRY.name), builds)?;
    output.rows(&format!("{}-means", ENTRY.name), &means)?;
    let mut text = String::from(
        "Ratios: how many times more rays a second than Embree, round by round on the same rays; \
         above 1 is faster.\n",
    );
    for arrangement in &ARRANGEMENTS {
        let _ = writeln!(text, "{}: {}", arrangement.name, arrangement.about);
    }
    for reference in &REFERENCES {
        text += &means_text(&means, reference);
        means_chart(output, &means, reference)?;
        for threads in thread_counts(rows) {
            cells_chart(output, rows, reference, threads)?;
        }
    }
    text += &cells_text(rows);
    text += &agreement_text(rows);
    text += &builds_text(builds);
    Ok(text)
}

fn thread_counts(rows: &[Row]) -> Vec<usize> {
    distinct(rows.iter().map(|row| row.threads))
}

/// Contenders that have a ratio: the native ones.
fn natives<'a>(rows: impl IntoIterator<Item = &'a Row>, reference: &Reference) -> Vec<&'a str> {
    let rows = rows.into_iter().filter(|row| (reference.ratio)(row).is_some());
    distinct(rows.map(|row| row.backend.as_str()))
}

fn threads_text(threads: Option<usize>) -> String {
    match threads {
        None => "any threads".into(),
        Some(1) => "1 thread".into(),
        Some(threads) => format!("{threads} threads"),
    }
}

/// For each reference, number of threads, group of cells and native contender.
fn means(rows: &[Row]) -> Vec<Mean> {
    let mut threads: Vec<Option<usize>> = thread_counts(rows).into_iter().map(Some).collect();
    if threads.len() > 1 {
        threads.push(None);
    }
    let arrangements = distinct(rows.iter().map(|row| row.arrangement));
    let groups =
        distinct(std::iter::once("all").chain(arrangements).chain(rows.iter().map(|row| row.rays)));
    let mut means = Vec::new();
    for reference in &REFERENCES {
        for &threads in &threads {
            for &group in &groups {
                for backend in natives(rows, reference) {
                    let of_mean = |row: &&Row| {
                        row.backend == backend
                            && threads.is_none_or(|threads| row.threads == threads)
                            && ["all", row.arrangement, row.rays].contains(&group)
                    };
                    let cells: Vec<(&Row, f64)> = rows
                        .iter()
                        .filter(of_mean)
                        .filter_map(|row| Some((row, (reference.ratio)(row)?)))
                        .collect();
                    let least = cells.iter().min_by(|a, b| a.1.total_cmp(&b.1));
                    let mean = geometric_mean(cells.iter().map(|cell| cell.1));
                    let (Some(&(row, least_ratio)), Some(ratio)) = (least, mean) else { continue };
                    means.push(Mean {
                        reference: reference.name,
                        threads,
                        group: group.to_string(),
                        backend: backend.to_string(),
                        cells: cells.len(),
                        ratio,
                        least_ratio,
                        least_cell: cell_name(row),
                    });
                }
            }
        }
    }
    means
}

fn cell_name(row: &Row) -> String {
    let threads = threads_text(Some(row.threads));
    format!("{}, {}, {}, {threads}", row.scene, row.rays, row.arrangement)
}

/// Mean and least ratio of each native contender, group by group; then the least cells.
fn means_text(means: &[Mean], reference: &Reference) -> String {
    let means: Vec<&Mean> = means.iter().filter(|m| m.reference == reference.name).collect();
    let backends = distinct(means.iter().map(|m| m.backend.as_str()));
    let mut text = format!("\nAgainst {}: geometric mean and least\n\n", reference.about);
    let columns = backends.iter().flat_map(|b| [format!("{b}\nmean"), "\nleast".into()]);
    let mut means_table = table(["cells".to_string()].into_iter().chain(columns));
    for (threads, group) in distinct(means.iter().map(|m| (m.threads, m.group.as_str()))) {
        let of_backend = |backend: &&str| {
            let wanted = (threads, group, *backend);
            let mean = means.iter().find(|m| (m.threads, m.group.as_str(), &*m.backend) == wanted);
            mean.map_or(["-".into(), "-".into()], |m| {
                [format!("{:.2}", m.ratio), format!("{:.2}", m.least_ratio)]
            })
        };
        let name = format!("{}, {group}", threads_text(threads));
        let values = backends.iter().flat_map(of_backend);
        means_table.add_row(std::iter::once(name).chain(values));
    }
    let _ = writeln!(text, "{}\n", means_table.trim_fmt());
    // The last of a contender is of all cells: of any number of threads, or of the only one.
    for backend in backends {
        let of_all = means.iter().rfind(|m| m.backend == backend && m.group == "all");
        if let Some(m) = of_all {
            let _ = writeln!(text, "least of {backend}: {:.2} in {}", m.least_ratio, m.least_cell);
        }
    }
    text
}

fn means_chart(output: &mut Output, means: &[Mean], reference: &Reference) -> Result<()> {
    let means: Vec<&Mean> = means.iter().filter(|m| m.reference == reference.name).collect();
    let backends = distinct(means.iter().map(|m| m.backend.as_str()));
    let mut groups = distinct(means.iter().map(|m| (m.threads, m.group.as_str())));
    // Classes and arrangements over all threads; of these, the means of all.
    let last = groups.last().map(|g| g.0);
    groups.retain(|g| g.1 == "all" || Some(g.0) == last);
    let group = |&(threads, group): &(Option<usize>, &str)| {
        let ratio = |backend: &&str| {
            let wanted = (threads, group, *backend);
            let mean = means.iter().find(|m| (m.threads, m.group.as_str(), &*m.backend) == wanted);
            mean.map_or(f64::NAN, |m| m.ratio)
        };
        let name = if group == "all" { threads_text(threads) } else { group.to_string() };
        Group::new(name, backends.iter().map(ratio))
    };
    output.chart(
        &format!("{}-means-{}", ENTRY.name, reference.name),
        &format!("Rays a second against {}", reference.about),
        "Geometric means of ratios over all cells, by threads, arrangement and class of rays; above \
         1 is faster than Embree.",
        Body::Bars(Bars {
            axis: Axis::log("ratio to Embree").with_reference(1.0),
            series: backends.iter().map(ToString::to_string).collect(),
            groups: groups.iter().map(group).collect(),
            better: Better::Higher,
            decimals: Some(2),
            ..Bars::default()
        }),
    )
}

/// Scenes and classes of rays by contender and arrangement.
fn cells_chart(
    output: &mut Output,
    rows: &[Row],
    reference: &Reference,
    threads: usize,
) -> Result<()> {
    let rows: Vec<&Row> = rows
        .iter()
        .filter(|row| row.threads == threads && (reference.ratio)(row).is_some())
        .collect();
    let columns = distinct(rows.iter().map(|row| (row.backend.as_str(), row.arrangement)));
    let lines = distinct(rows.iter().map(|row| (row.scene.as_str(), row.rays)));
    let at = |line: &(&str, &str), column: &(&str, &str)| {
        let wanted = (*line, *column);
        let row =
            rows.iter().find(|r| ((&*r.scene, r.rays), (&*r.backend, r.arrangement)) == wanted);
        row.and_then(|row| (reference.ratio)(row)).unwrap_or(f64::NAN)
    };
    let mut values: Vec<Vec<f64>> =
        lines.iter().map(|line| columns.iter().map(|column| at(line, column)).collect()).collect();
    let mean = |column: usize| geometric_mean(values.iter().map(|line| line[column]));
    values.push((0..columns.len()).map(|column| mean(column).unwrap_or(f64::NAN)).collect());
    let share = |line: &(&str, &str)| {
        let row = rows.iter().find(|row| (row.scene.as_str(), row.rays) == *line);
        row.map_or(f64::NAN, |row| 100.0 * row.occluded_share)
    };
    output.chart(
        &format!("{}-{}-threads-{threads}", ENTRY.name, reference.name),
        &format!("Rays a second against {}, {}", reference.about, threads_text(Some(threads))),
        "Median ratio of interleaved rounds on the same rays; above 1 is faster than Embree.",
        Body::HeatTable(HeatTable {
            axis: Axis::log("ratio to Embree").with_reference(1.0),
            row_title: "scene and rays".into(),
            rows: lines
                .iter()
                .map(|line| format!("{} {} ({:.0} % occluded)", line.0, line.1, share(line)))
                .chain(["geometric mean".to_string()])
                .collect(),
            column_title: "contender and arrangement of the rays".into(),
            columns: columns.iter().map(|column| format!("{} {}", column.0, column.1)).collect(),
            values,
            decimals: Some(2),
        }),
    )
}

/// The first contender's ratios in every cell.
fn cells_text(rows: &[Row]) -> String {
    let Some(first) = rows.first().map(|row| row.backend.as_str()) else { return String::new() };
    let rows: Vec<&Row> = rows.iter().filter(|row| row.backend == first).collect();
    let mut text = format!("\n{first}: ratio to single rays of Embree / to its best\n\n");
    let mut columns = distinct(rows.iter().map(|row| (row.threads, row.arrangement)));
    columns.sort_by_key(|column| column.0);
    let header = columns
        .iter()
        .map(|(threads, arrangement)| format!("{}\n{arrangement}", threads_text(Some(*threads))));
    let leading = ["scene and rays", "rays", "occluded %"].map(String::from);
    let mut cells = table(leading.into_iter().chain(header));
    for (scene, rays) in distinct(rows.iter().map(|row| (row.scene.as_str(), row.rays))) {
        let of_line = || rows.iter().filter(move |r| (r.scene.as_str(), r.rays) == (scene, rays));
        let (count, share) =
            of_line().next().map_or((0, 0.0), |r| (r.ray_count, 100.0 * r.occluded_share));
        let ratio = |value: Option<f64>| value.map_or("-".into(), |value| format!("{value:.2}"));
        let values = columns.iter().map(|column| {
            of_line().find(|r| (r.threads, r.arrangement) == *column).map_or("-".into(), |r| {
                format!("{} / {}", ratio(r.ratio_to_single), ratio(r.ratio_to_best))
            })
        });
        let leading = [format!("{scene} {rays}"), count.to_string(), format!("{share:.1}")];
        cells.add_row(leading.into_iter().chain(values));
    }
    let _ = writeln!(text, "{}", cells.trim_fmt());
    text
}

/// On how many rays of all cells each contender answers otherwise than the first.
fn agreement_text(rows: &[Row]) -> String {
    let Some(first) = rows.first().map(|row| row.backend.as_str()) else { return String::new() };
    let mut text = String::from("\n");
    for backend in distinct(rows.iter().map(|row| row.backend.as_str())).into_iter().skip(1) {
        let of_backend = || rows.iter().filter(|row| row.backend == backend);
        let rays: usize = of_backend().map(|row| row.ray_count).sum();
        let differing: usize = of_backend().map(|row| row.differing_rays).sum();
        let _ = match differing {
            0 => writeln!(text, "{backend} and {first} agree on all of {rays} answers"),
            n => writeln!(text, "{backend} and {first} differ on {n} of {rays} answers"),
        };
    }
    text
}

fn builds_text(rows: &[builds::Row]) -> String {
    let mut text = String::from(
        "\nBuilds: milliseconds with the order (how many times faster than Embree's medium \
         quality), memory of the tree and with the mesh\n\n",
    );
    let threads = distinct(rows.iter().map(|row| row.threads));
    let times = threads.iter().map(|&threads| threads_text(Some(threads)));
    let header = ["scene", "triangles", "backend"].map(String::from).into_iter();
    let header = header.chain(times).chain(["tree MB", "with mesh MB"].map(String::from));
    let mut builds = table(header);
    for (scene, backend) in distinct(rows.iter().map(|r| (r.scene.as_str(), r.backend.as_str()))) {
        let of_line = || rows.iter().filter(move |r| (&*r.scene, &*r.backend) == (scene, backend));
        let Some(first) = of_line().next() else { continue };
        let leading = [scene.to_string(), first.triangles.to_string(), backend.to_string()];
        let times = threads.iter().map(|&threads| {
            of_line().find(|row| row.threads == threads).map_or("-".into(), |row| {
                let ratio = row.ratio_to_medium.map_or(String::new(), |r| format!(" ({r:.2})"));
                format!("{:.1}{ratio}", row.total_ms)
            })
        });
        let memory = [first.memory_bytes, first.memory_with_mesh_bytes]
            .map(|bytes| format!("{:.1}", bytes as f64 / 1e6));
        builds.add_row(leading.into_iter().chain(times).chain(memory));
    }
    let _ = writeln!(text, "{}\n", builds.trim_fmt());
    // The last number of threads is that of the whole run.
    let of_run = rows.iter().filter(|row| Some(&row.threads) == threads.last());
    for note in distinct(of_run.map(|row| (row.backend.as_str(), row.notes.as_str()))) {
        if !note.1.is_empty() {
            let _ = writeln!(text, "{}: {}", note.0, note.1);
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Embree's rows have no ratios.
    fn row(place: (&str, &'static str, usize), backend: &str, ratios: Option<[f64; 2]>) -> Row {
        let (scene, arrangement, threads) = place;
        let [single, best] = [0, 1].map(|reference| ratios.map(|ratios| ratios[reference]));
        Row {
            scene: scene.into(),
            triangles: 1,
            rays: "ao",
            arrangement,
            threads,
            backend: backend.into(),
            ray_count: 100,
            batch_count: 1,
            occluded_share: 0.5,
            differing_rays: if ratios.is_none() { 3 } else { 0 },
            trace_ms: 1.0,
            trace_ms_min: 1.0,
            trace_ms_max: 1.0,
            mrays_per_s: 0.1,
            ratio_to_single: single,
            ratio_to_single_min: single,
            ratio_to_single_max: single,
            single: single.map(|_| "embree".into()),
            ratio_to_best: best,
            ratio_to_best_min: best,
            ratio_to_best_max: best,
            best: best.map(|_| "embree:width=8".into()),
            notes: String::new(),
        }
    }

    fn rows() -> Vec<Row> {
        vec![
            row(("ship", "tiles", 1), "bvh8", Some([4.0, 2.0])),
            row(("ship", "tiles", 1), "embree", None),
            row(("ship", "tiles", 2), "bvh8", Some([1.0, 0.5])),
            row(("ship", "tiles", 2), "embree", None),
            row(("ship", "shuffled", 1), "bvh8", Some([9.0, 8.0])),
            row(("ship", "shuffled", 1), "embree", None),
            row(("room", "tiles", 1), "bvh8", Some([1.0, 1.0])),
            row(("room", "tiles", 1), "embree", None),
        ]
    }

    #[test]
    fn means_are_geometric_and_name_their_least_cell() {
        let means = means(&rows());
        let find = |reference: &str, threads: Option<usize>, group: &str| {
            let wanted = (reference, threads, group);
            let mean = means.iter().find(|m| (m.reference, m.threads, m.group.as_str()) == wanted);
            mean.unwrap_or_else(|| panic!("no mean of {wanted:?}"))
        };
        let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
        let tiles = find("single", Some(1), "tiles");
        assert!(close(tiles.ratio, 2.0) && tiles.cells == 2, "{tiles:?}");
        assert!(close(tiles.least_ratio, 1.0), "{tiles:?}");
        assert_eq!(tiles.least_cell, "room, ao, tiles, 1 thread");
        let all = find("best", None, "all");
        assert!(close(all.ratio, 8f64.powf(0.25)) && all.cells == 4, "{all:?}");
        assert_eq!(all.least_cell, "ship, ao, tiles, 2 threads");
        assert!(close(find("best", None, "ao").ratio, all.ratio));
        assert!(close(find("single", Some(1), "shuffled").ratio, 9.0));
        // No cell has two threads and shuffled rays; Embree has no ratio to itself.
        assert!(means.iter().all(|m| m.threads != Some(2) || m.group != "shuffled"));
        assert!(means.iter().all(|m| m.backend == "bvh8"));
    }

    #[test]
    fn text_has_every_mean_and_the_disagreement() {
        let rows = rows();
        let text = means_text(&means(&rows), &REFERENCES[1]);
        let line = text.lines().find(|line| line.starts_with("1 thread, tiles")).unwrap();
        let words: Vec<&str> = line.split_whitespace().collect();
        assert_eq!(words, ["1", "thread,", "tiles", "1.41", "1.00"]);
        assert!(text.contains("least of bvh8: 0.50 in ship, ao, tiles, 2 threads"), "{text}");
        assert!(agreement_text(&rows).contains("embree and bvh8 differ on 12 of 400 answers"));
        assert!(cells_text(&rows).contains("9.00 / 8.00"), "{}", cells_text(&rows));
    }

    #[test]
    fn nothing_measured_is_said_without_a_table() {
        assert_eq!(means(&[]), []);
        assert_eq!(cells_text(&[]) + &agreement_text(&[]), "");
    }
}
