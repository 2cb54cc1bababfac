//! The rectangle that data is drawn in, with its axes.

use super::axis::{Span, Tick};
use super::drawing::{Drawing, HAlign, Place, Text, line_height};
use super::font;
use super::palette::{FAINT_GRID, FAINT_INK, GRID, INK};

/// Sizes of text in pixels.
pub(super) const TITLE: f64 = 20.0;
pub(super) const AXIS_TITLE: f64 = 14.0;
pub(super) const LABEL: f64 = 13.0;

/// From an axis to its tick labels.
const TICK_GAP: f64 = 7.0;

/// A rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Area {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) right: f64,
    pub(super) bottom: f64,
}

/// Room for an axis's tick labels and title, below an area.
pub(super) const BELOW_TICKS: f64 = 24.0;

impl Area {
    pub(super) fn width(&self) -> f64 {
        self.right - self.left
    }

    pub(super) fn height(&self) -> f64 {
        self.bottom - self.top
    }

    /// Where a value lies from left to right.
    pub(super) fn x(&self, span: &Span, value: f64) -> Option<f64> {
        Some(self.left + self.width() * span.part(value)?)
    }

    /// Where a value lies from bottom to top.
    pub(super) fn y(&self, span: &Span, value: f64) -> Option<f64> {
        Some(self.bottom - self.height() * span.part(value)?)
    }

    /// Lines from top to bottom at the ticks, their labels below.
    pub(super) fn x_ticks(&self, drawing: &mut Drawing, span: &Span, ticks: &[Tick]) {
        let mut occupied = f64::NEG_INFINITY;
        for tick in ticks {
            let Some(x) = self.x(span, tick.value) else { continue };
            let colour = if tick.label.is_empty() { FAINT_GRID } else { GRID };
            drawing.vertical(x, [self.top, self.bottom], colour);
            // A label that would touch the one before is left out.
            let half = 0.5 * font::width(&tick.label, LABEL, false);
            if x - half > occupied + 5.0 {
                let at = [x, self.bottom + TICK_GAP + 0.5 * LABEL];
                drawing.text(Text::new(at, &tick.label, LABEL, HAlign::Centre));
                if !tick.label.is_empty() {
                    occupied = x + half;
                }
            }
        }
    }

    /// Lines from left to right at the ticks, their labels at the left.
    pub(super) fn y_ticks(&self, drawing: &mut Drawing, span: &Span, ticks: &[Tick]) {
        let mut occupied = f64::INFINITY;
        for tick in ticks {
            let Some(y) = self.y(span, tick.value) else { continue };
            let colour = if tick.label.is_empty() { FAINT_GRID } else { GRID };
            drawing.horizontal([self.left, self.right], y, colour);
            if !tick.label.is_empty() && y + LABEL < occupied {
                drawing.text(Text::new(
                    [self.left - TICK_GAP, y],
                    &tick.label,
                    LABEL,
                    HAlign::Right,
                ));
                occupied = y;
            }
        }
    }

    /// The title of the axis at the left, read upwards, `reach` left of the area.
    pub(super) fn y_title(&self, drawing: &mut Drawing, title: &str, reach: f64) {
        let lines = font::wrap_evenly(title, AXIS_TITLE, false, self.height());
        let step = line_height(AXIS_TITLE);
        let first = self.left - reach - step * (lines.len() as f64 - 0.5);
        for (row, line) in lines.iter().enumerate() {
            let at = [first + step * row as f64, 0.5 * (self.top + self.bottom)];
            drawing.text(Text::new(at, line, AXIS_TITLE, HAlign::Centre).upwards());
        }
    }

    /// Width that the left axis takes: of its tick labels, and with its title.
    pub(super) fn y_reach(title: &str, height: f64, ticks: &[Tick]) -> [f64; 2] {
        let labels = ticks.iter().map(|t| font::width(&t.label, LABEL, false));
        let labels = (labels.fold(0.0, f64::max) + TICK_GAP + 6.0).ceil();
        if title.is_empty() {
            return [labels, labels];
        }
        let lines = font::wrap_evenly(title, AXIS_TITLE, false, height).len() as f64;
        [labels, labels + lines * line_height(AXIS_TITLE)]
    }

    /// The title of the axis below, under the tick labels; returns the height that it takes.
    pub(super) fn x_title(&self, drawing: &mut Drawing, title: &str) -> f64 {
        if title.is_empty() {
            return 0.0;
        }
        let lines = font::wrap_evenly(title, AXIS_TITLE, false, self.width());
        let height = lines.len() as f64 * line_height(AXIS_TITLE);
        let at = [0.5 * (self.left + self.right), self.bottom + BELOW_TICKS + 0.5 * height];
        drawing.lines(at, &lines, AXIS_TITLE, HAlign::Centre);
        height
    }

    /// The axes' own lines.
    pub(super) fn frame(&self, drawing: &mut Drawing) {
        drawing.vertical(self.left, [self.top, self.bottom], FAINT_INK);
        drawing.horizontal([self.left, self.right], self.bottom, FAINT_INK);
    }

    /// A line from side to side at a value of the left axis that is marked.
    pub(super) fn y_reference(&self, drawing: &mut Drawing, y: f64) {
        drawing.dashes([self.left, y.floor() + 0.5], [self.right, y.floor() + 0.5], 1.5, INK);
    }

    /// A line from top to bottom at a value of the lower axis that is marked.
    pub(super) fn x_reference(&self, drawing: &mut Drawing, x: f64) {
        drawing.dashes([x.floor() + 0.5, self.top], [x.floor() + 0.5, self.bottom], 1.5, INK);
    }
}

/// A line with caps from the least to the largest of several measurements.
pub(super) fn whisker(drawing: &mut Drawing, ends: [Place; 2]) {
    let [a, b] = ends;
    let cap = if a[0] == b[0] { [3.5, 0.0] } else { [0.0, 3.5] };
    drawing.line(a, b, 1.25, INK);
    for end in ends {
        let [from, to] = [-1.0, 1.0].map(|s| [end[0] + s * cap[0], end[1] + s * cap[1]]);
        drawing.line(from, to, 1.25, INK);
    }
}

/// What stands where data should be.
pub(super) fn nothing() -> Drawing {
    let size = [720.0, 220.0];
    let mut drawing = Drawing::new(size);
    drawing.rect([0.0, 0.0], size, FAINT_GRID);
    let at = size.map(|length| 0.5 * length);
    drawing.text(Text::new(at, "no data to show", AXIS_TITLE, HAlign::Centre).colour(FAINT_INK));
    drawing
}
