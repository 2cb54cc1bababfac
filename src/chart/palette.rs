//! Colours, patterns and markers that tell series apart, for colour-blind readers and in print too.

use super::drawing::{Colour, Drawing, Place};

pub(super) const WHITE: Colour = [255, 255, 255];
/// Text and axes.
pub(super) const INK: Colour = [34, 34, 34];
/// Text that matters less.
pub(super) const FAINT_INK: Colour = [95, 95, 95];
/// Lines at labelled ticks, and at those between.
pub(super) const GRID: Colour = [222, 222, 222];
pub(super) const FAINT_GRID: Colour = [240, 240, 240];
/// Every other row of a panel.
pub(super) const STRIPE: Colour = [247, 247, 247];
/// What has no value.
pub(super) const MISSING: Colour = [232, 232, 232];
/// Better than a reference, and worse: blue and vermilion, which no common colour blindness mixes.
pub(super) const BETTER: Colour = [0, 114, 178];
pub(super) const WORSE: Colour = [213, 94, 0];

/// The palette of Okabe and Ito, its yellow, too faint on white, and its black replaced by the olive
/// and the wine of Paul Tol's muted palette.
const SERIES: [Colour; 8] = [
    [0, 114, 178],
    [230, 159, 0],
    [0, 158, 115],
    [213, 94, 0],
    [204, 121, 167],
    [86, 180, 233],
    [136, 34, 85],
    [153, 153, 51],
];

/// The shape of a marker.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    Disk,
    Corners(&'static [Place]),
}

/// Of like area; in halves of a marker's size.
const SHAPES: [Shape; 6] = [
    Shape::Disk,
    Shape::Corners(&[[-0.88, -0.88], [0.88, -0.88], [0.88, 0.88], [-0.88, 0.88]]),
    Shape::Corners(&[[0.0, -1.2], [1.15, 0.85], [-1.15, 0.85]]),
    Shape::Corners(&[[0.0, -1.3], [1.3, 0.0], [0.0, 1.3], [-1.3, 0.0]]),
    Shape::Corners(&[[0.0, 1.2], [1.15, -0.85], [-1.15, -0.85]]),
    Shape::Corners(&[[0.0, -1.1], [1.1, -0.25], [0.68, 0.95], [-0.68, 0.95], [-1.1, -0.25]]),
];

/// How one series looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Look {
    pub(super) colour: Colour,
    /// Bars with white stripes, markers hollow, lines of dashes: for the second eight series.
    pub(super) patterned: bool,
    shape: Shape,
}

impl Look {
    /// Of the series with this index. The first eight have colours of their own, the next eight the
    /// same with a pattern; from then on they get darker.
    pub(super) fn of(index: usize) -> Self {
        let dark = 0.6_f64.powi((index / 16).min(3) as i32);
        Self {
            colour: SERIES[index % 8].map(|c| (dark * f64::from(c)).round() as u8),
            patterned: index / 8 % 2 == 1,
            shape: SHAPES[index % 6],
        }
    }

    /// A bar between two corners.
    pub(super) fn bar(&self, drawing: &mut Drawing, from: Place, to: Place) {
        drawing.rect(from, to, self.colour);
        if !self.patterned {
            return;
        }
        // Stripes at 45 degrees, cut off at the edges: x + y is the same along each.
        let ([left, top], [right, bottom]) = (from, to);
        let mut sum = left + top + 4.0;
        while sum < right + bottom {
            let start = [left.max(sum - bottom), bottom.min(sum - left)];
            let end = [right.min(sum - top), top.max(sum - right)];
            drawing.line(start, end, 1.25, WHITE);
            sum += 6.0;
        }
    }

    /// A marker.
    pub(super) fn marker(&self, drawing: &mut Drawing, at: Place, radius: f64) {
        self.shape(drawing, at, radius, self.colour);
        if self.patterned {
            self.shape(drawing, at, 0.5 * radius, WHITE);
        }
    }

    fn shape(&self, drawing: &mut Drawing, at: Place, radius: f64, colour: Colour) {
        match self.shape {
            Shape::Disk => drawing.disk(at, radius, colour, 1.0),
            Shape::Corners(corners) => {
                let corner = |[x, y]: &Place| [at[0] + radius * x, at[1] + radius * y];
                drawing.polygon(corners.iter().map(corner).collect(), colour);
            }
        }
    }

    /// A piece of a line.
    pub(super) fn line(&self, drawing: &mut Drawing, from: Place, to: Place) {
        if self.patterned {
            drawing.dashes(from, to, 2.0, self.colour);
        } else {
            drawing.line(from, to, 2.0, self.colour);
        }
    }
}

/// Where `part`, 0 to 1, lies between evenly spaced colours.
pub(super) fn between(stops: &[Colour], part: f64) -> Colour {
    let at = part.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
    let first = (at as usize).min(stops.len() - 2);
    let weight = at - first as f64;
    std::array::from_fn(|channel| {
        let [a, b] = [stops[first], stops[first + 1]].map(|stop| f64::from(stop[channel]));
        (a + weight * (b - a)).round() as u8
    })
}

/// Black or white, whichever is easier to read on `ground`.
pub(super) fn ink_on(ground: Colour) -> Colour {
    let linear = ground.map(|c| (f64::from(c) / 255.0).powf(2.2));
    let luminance = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
    // Both have the same contrast at 0.21; on saturated colours white is the easier one a little
    // longer.
    if luminance > 0.26 { INK } else { WHITE }
}
