//! Charts of the errors, and what renderers make of a detail in the same time.

use super::reference::Reference;
use super::rows::Cell;
use super::trial::{Contender, Trial};
use super::view::{Planes, raw_planes};
use super::{Plan, PointRow, Settings};
use crate::Result;
use crate::chart::{Axis, Body, Picture, PictureRow, Pictures, Point, Series, Xy};
use crate::image_file::to_srgb;
use crate::measure::image_error::squared_error;
use crate::render::RenderSettings;
use crate::results::Output;
use crate::scene::Scene;

/// Longest side of a detail, in pixels.
const DETAIL: u32 = 64;
/// Rows of the strip: what of the first renderer's most samples they have the time for.
const PARTS: [u32; 3] = [16, 4, 1];

/// Details at equal time.
pub(super) struct Strip {
    pictures: Pictures,
    subtitle: String,
}

/// Renders what each renderer makes in the same times, and cuts out the noisiest detail.
pub(super) fn strip(
    scene: &Scene,
    contenders: &[Contender<'_>],
    settings: &RenderSettings,
    plan: &Settings,
    reference: &Reference,
    trial: &Trial,
) -> Result<Strip> {
    let size = reference.view.size;
    let detail = size.map(|side| side.min(DETAIL));
    let corner = noisiest(&trial.noise, size, detail);
    let curves: Vec<_> = trial.measured.iter().map(|m| m.runs().whole()).collect();
    let cut = |planes: &Planes| cut(&reference.view.shown(planes), size, corner, detail);
    let mut budgets: Vec<u32> = PARTS.iter().map(|part| (plan.spp / part).max(1)).collect();
    budgets.dedup();
    let mut rows = Vec::new();
    for samples in budgets {
        // The budget is what the first renderer is known to take.
        let Some(ms) = curves[0].points.iter().find(|p| p.samples >= samples).map(|p| p.ms) else {
            continue;
        };
        let mut pictures = Vec::new();
        for (contender, curve) in contenders.iter().zip(&curves) {
            // What takes a tenth longer than that with one sample is within what times vary.
            let in_time = |factor: f64| curve.samples_for_ms(factor * ms);
            let Some(samples) = in_time(1.0).or_else(|| in_time(1.1)) else {
                pictures.push(None);
                continue;
            };
            let rendering = contender.render(scene, settings, samples, plan.seed)?;
            let planes = reference.view.scaled(&raw_planes(&rendering.film, settings.passes[0]));
            let error = squared_error(&planes, &reference.planes, &reference.view.pixels).sqrt();
            let many = if samples == 1 { "sample" } else { "samples" };
            let caption = vec![
                format!("{samples} {many}, {:.0} ms", rendering.stats.total_ms),
                format!("RMSE {}", short(error)),
            ];
            pictures.push(Some(Picture { size: detail, pixels: cut(&planes), caption }));
        }
        let caption = vec![
            format!("{} x {} samples", reference.report.parts, reference.report.samples_per_part),
            format!("RMSE {}", short(reference.report.rmse)),
        ];
        let pixels = cut(&reference.planes);
        pictures.push(Some(Picture { size: detail, pixels, caption }));
        rows.push(PictureRow { title: format!("about {ms:.0} ms"), pictures });
    }
    let names = contenders.iter().map(|c| c.spec.label.clone());
    let [left, top] = corner;
    let [width, height] = detail;
    Ok(Strip {
        pictures: Pictures { columns: names.chain(["reference".into()]).collect(), rows, zoom: 3 },
        subtitle: format!(
            "detail of {width}x{height} pixels at ({left}, {top}) of {}x{}; errors are of whole images, an empty place has no image by then",
            size[0], size[1]
        ),
    })
}

/// Two or three digits.
fn short(value: f64) -> String {
    if value >= 0.01 { format!("{value:.3}") } else { format!("{value:.1e}") }
}

/// Upper left corner of the detail with most noise.
fn noisiest(noise: &[f32], [width, height]: [u32; 2], detail: [u32; 2]) -> [u32; 2] {
    // Sums over all that lies left of and above each corner.
    let columns = width as usize + 1;
    let mut sums = vec![0.0f64; columns * (height as usize + 1)];
    for y in 0..height as usize {
        let mut row = 0.0;
        for x in 0..width as usize {
            row += f64::from(noise[y * width as usize + x]);
            sums[(y + 1) * columns + x + 1] = sums[y * columns + x + 1] + row;
        }
    }
    let at = |x: u32, y: u32| sums[y as usize * columns + x as usize];
    let (mut best, mut most) = ([0, 0], f64::NEG_INFINITY);
    for y in 0..=height - detail[1] {
        for x in 0..=width - detail[0] {
            let [right, bottom] = [x + detail[0], y + detail[1]];
            let sum = at(right, bottom) - at(x, bottom) - at(right, y) + at(x, y);
            if sum > most {
                (best, most) = ([x, y], sum);
            }
        }
    }
    best
}

fn cut(shown: &[glam::Vec3], size: [u32; 2], corner: [u32; 2], detail: [u32; 2]) -> Vec<[u8; 3]> {
    let row = |y: u32| {
        let start = (y * size[0] + corner[0]) as usize;
        shown[start..start + detail[0] as usize].iter().map(|c| c.to_array().map(to_srgb))
    };
    (corner[1]..corner[1] + detail[1]).flat_map(row).collect()
}

/// Draws the charts of one scene and pass.
pub(super) fn write(output: &mut Output, cell: &Cell, plan: &Plan, strip: Strip) -> Result<()> {
    let report = &cell.report;
    let (scene, pass) = (&report.scene, report.pass);
    let stem = format!("{scene}-{pass}");
    let [width, height] = report.size;
    let subtitle = format!(
        "{width}x{height} pixels, {} seeds; whiskers: 95 % intervals; in (): slope over samples",
        plan.settings.seeds
    );
    let series = |x: fn(&PointRow) -> f64, groups: &[Vec<usize>]| -> Vec<Series> {
        let line = |group: &Vec<usize>| {
            let labels = group.iter().map(|&index| plan.renderers[index].label.as_str());
            let name = labels.collect::<Vec<_>>().join(", ");
            let slope = report.slopes[group[0]].slope;
            let name = slope.map_or(name.clone(), |slope| format!("{name} ({:.2})", slope.value));
            let point =
                |p: &PointRow| Point { x: x(p), y: p.rmse, range: Some([p.rmse_low, p.rmse_high]) };
            Series::line(name, points_of(cell, plan, group[0]).map(point))
        };
        groups.iter().map(line).collect()
    };
    let alone: Vec<Vec<usize>> = (0..plan.renderers.len()).map(|index| vec![index]).collect();
    let error = Axis::log(format!("RMSE [{}]", report.unit));
    output.chart(
        &format!("{stem}-over-samples"),
        &format!("{scene}, {pass}: error over samples"),
        &subtitle,
        Body::Xy(Xy {
            x_axis: Axis::log("samples in a pixel"),
            y_axis: error.clone(),
            series: series(|p| f64::from(p.samples), &with_equal_errors(cell, plan)),
        }),
    )?;
    output.chart(
        &format!("{stem}-over-time"),
        &format!("{scene}, {pass}: error over time"),
        &subtitle,
        Body::Xy(Xy {
            x_axis: Axis::log("time of an image, without building [ms]"),
            y_axis: error,
            series: series(|p| p.total_ms, &alone),
        }),
    )?;
    output.pictures(
        &format!("{stem}-equal-time"),
        &format!("{scene}, {pass}: in the same time"),
        &strip.subtitle,
        Body::Pictures(strip.pictures),
    )
}

fn points_of<'a>(
    cell: &'a Cell,
    plan: &'a Plan,
    renderer: usize,
) -> impl Iterator<Item = &'a PointRow> {
    let label = &plan.renderers[renderer].label;
    cell.points.iter().filter(move |p| p.renderer == *label)
}

/// Renderers in groups whose errors are the same for the eye: one line stands for all of them.
fn with_equal_errors(cell: &Cell, plan: &Plan) -> Vec<Vec<usize>> {
    let is_near = |(a, b): (&PointRow, &PointRow)| (a.rmse - b.rmse).abs() <= 5e-3 * a.rmse;
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for index in 0..plan.renderers.len() {
        let is_of = |group: &&mut Vec<usize>| {
            let theirs = points_of(cell, plan, group[0]);
            theirs.zip(points_of(cell, plan, index)).all(is_near)
        };
        match groups.iter_mut().find(is_of) {
            Some(group) => group.push(index),
            None => groups.push(vec![index]),
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noisiest_detail_is_found() {
        let mut noise = vec![0.0; 20 * 10];
        noise[7 * 20 + 13] = 2.0;
        noise[3] = 1.0;
        let [x, y] = noisiest(&noise, [20, 10], [4, 3]);
        assert!((10..=13).contains(&x) && (5..=7).contains(&y), "{x} {y}");
        assert_eq!(noisiest(&noise, [20, 10], [20, 10]), [0, 0]);
    }
}
