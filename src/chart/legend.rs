//! Which look is which series: beside or below the data, never on it.

use super::area::LABEL;
use super::drawing::{Drawing, HAlign, Place, line_height};
use super::font;
use super::palette::Look;

/// What a legend shows before a name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Swatch {
    Bar,
    Line,
    Marker,
}

const SWATCH_WIDTH: f64 = 26.0;
const GAP: f64 = 8.0;
/// Between columns.
const BETWEEN: f64 = 24.0;
/// A legend with narrower names stands beside the data, else below.
const BESIDE: f64 = 210.0;

/// One series: name, look, and what is shown of it.
pub(super) type Entry = (String, Look, Swatch);

/// A drawing of the data with the legend added, at its right if names are short and there is the
/// height for all, else below, from `left` on.
pub(super) fn add(mut data: Drawing, entries: &[Entry], left: f64, top: f64) -> Drawing {
    if entries.iter().all(|(name, ..)| name.trim().is_empty()) {
        return data;
    }
    let row = line_height(LABEL) + 4.0;
    let widest =
        entries.iter().map(|(name, ..)| font::width(name, LABEL, false)).fold(0.0, f64::max);
    let [width, height] = data.size;
    if widest <= BESIDE && entries.len() as f64 * row <= height - top {
        let legend = columns(entries, 1, widest);
        data.size[0] += BETWEEN + legend.size[0];
        data.place(legend, [width + BETWEEN, top]);
        return data;
    }
    let available = (width - left).max(BESIDE);
    let column = widest.min(available - SWATCH_WIDTH - GAP);
    let count = ((available + BETWEEN) / (SWATCH_WIDTH + GAP + column + BETWEEN)).max(1.0);
    let legend = columns(entries, count as usize, column);
    data.size = [width.max(left + legend.size[0]), height + 14.0 + legend.size[1]];
    data.place(legend, [left, height + 14.0]);
    data
}

/// Entries in columns, read down the first, then the next.
fn columns(entries: &[Entry], count: usize, name_width: f64) -> Drawing {
    let rows = entries.len().div_ceil(count);
    let mut drawing = Drawing::default();
    let step = SWATCH_WIDTH + GAP + name_width.ceil() + BETWEEN;
    for (column, entries) in entries.chunks(rows).enumerate() {
        let left = step * column as f64;
        let mut y = 0.0;
        for (name, look, swatch) in entries {
            let lines = font::wrap(name, LABEL, false, name_width + 1.0);
            let height = lines.len() as f64 * line_height(LABEL) + 4.0;
            draw(&mut drawing, *look, *swatch, [left, y + 0.5 * height]);
            let at = [left + SWATCH_WIDTH + GAP, y + 0.5 * height];
            drawing.lines(at, &lines, LABEL, HAlign::Left);
            y += height;
        }
        drawing.size = [left + step - BETWEEN, drawing.size[1].max(y)];
    }
    drawing
}

fn draw(drawing: &mut Drawing, look: Look, swatch: Swatch, [x, y]: Place) {
    let middle = [x + 0.5 * SWATCH_WIDTH, y];
    match swatch {
        Swatch::Bar => {
            look.bar(drawing, [x + 2.0, y - 6.0], [x + SWATCH_WIDTH - 2.0, y + 6.0]);
        }
        Swatch::Line => {
            look.line(drawing, [x, y], [x + SWATCH_WIDTH, y]);
            look.marker(drawing, middle, 4.5);
        }
        Swatch::Marker => look.marker(drawing, middle, 4.5),
    }
}
