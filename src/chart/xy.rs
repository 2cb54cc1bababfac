//! Lines and points over two axes of values.

use super::area::{Area, BELOW_TICKS, LABEL, nothing, whisker};
use super::axis::{Axis, Span};
use super::drawing::Drawing;
use super::font;
use super::legend::{self, Swatch};
use super::palette::Look;

/// How a series is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mark {
    /// A line from point to point, a marker at each; gaps interrupt it.
    #[default]
    Line,
    /// Points alone.
    Points,
}

/// A point of a series. One without a place on the axes is a gap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Along the lower axis.
    pub x: f64,
    /// Along the left axis.
    pub y: f64,
    /// The least and the largest `y` of several measurements, drawn as whiskers.
    pub range: Option<[f64; 2]>,
}

impl From<[f64; 2]> for Point {
    fn from([x, y]: [f64; 2]) -> Self {
        Self { x, y, range: None }
    }
}

/// Points that belong together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// What the legend calls it.
    pub name: String,
    /// How it is drawn.
    pub mark: Mark,
    /// In the order in which a line visits them.
    pub points: Vec<Point>,
}

impl Series {
    /// A line through points.
    pub fn line<P: Into<Point>>(
        name: impl Into<String>,
        points: impl IntoIterator<Item = P>,
    ) -> Self {
        let points = points.into_iter().map(Into::into).collect();
        Self { name: name.into(), mark: Mark::Line, points }
    }

    /// Points alone.
    pub fn points<P: Into<Point>>(
        name: impl Into<String>,
        points: impl IntoIterator<Item = P>,
    ) -> Self {
        Self { mark: Mark::Points, ..Self::line(name, points) }
    }
}

/// A chart of lines, of points, or of both.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Xy {
    /// The lower axis.
    pub x_axis: Axis,
    /// The left axis.
    pub y_axis: Axis,
    /// Drawn in this order, later ones over earlier ones.
    pub series: Vec<Series>,
}

const PLOT: [f64; 2] = [820.0, 500.0];
/// Series of more points than this get small see-through dots, lines no markers.
const FEW: usize = 400;

impl Xy {
    fn holds(&self, point: &Point) -> bool {
        self.x_axis.scale.holds(point.x) && self.y_axis.scale.holds(point.y)
    }

    pub(super) fn draw(&self) -> Drawing {
        let shown = || self.series.iter().flat_map(|s| &s.points).filter(|p| self.holds(p));
        let x_span = Span::around(&self.x_axis, shown().map(|p| p.x));
        let ys = shown().flat_map(|p| [Some(p.y), p.range.map(|r| r[0]), p.range.map(|r| r[1])]);
        let y_span = Span::around(&self.y_axis, ys.flatten());
        let (Some(x_span), Some(y_span)) = (x_span, y_span) else { return nothing() };
        let (x_ticks, y_ticks) = (x_span.ticks(9), y_span.ticks(8));
        let [labels, reach] = Area::y_reach(&self.y_axis.title, PLOT[1], &y_ticks);
        let area = Area { left: reach, top: 8.0, right: reach + PLOT[0], bottom: 8.0 + PLOT[1] };

        let mut drawing = Drawing::default();
        area.x_ticks(&mut drawing, &x_span, &x_ticks);
        area.y_ticks(&mut drawing, &y_span, &y_ticks);
        area.y_title(&mut drawing, &self.y_axis.title, labels);
        let title_height = area.x_title(&mut drawing, &self.x_axis.title);
        if let Some(x) = self.x_axis.usable_reference().and_then(|v| area.x(&x_span, v)) {
            area.x_reference(&mut drawing, x);
        }
        if let Some(y) = self.y_axis.usable_reference().and_then(|v| area.y(&y_span, v)) {
            area.y_reference(&mut drawing, y);
        }
        self.draw_dots(&mut drawing, &area, [&x_span, &y_span]);
        for (index, series) in self.series.iter().enumerate() {
            self.draw_series(&mut drawing, &area, [&x_span, &y_span], index, series);
        }
        area.frame(&mut drawing);

        // The last label of the lower axis may stand out at the right.
        let last = x_ticks.iter().map(|t| font::width(&t.label, LABEL, false)).fold(0.0, f64::max);
        drawing.size =
            [area.right + 0.5 * last + 2.0, area.bottom + BELOW_TICKS + title_height + 2.0];
        let entries = self.series.iter().enumerate().map(|(index, series)| {
            let swatch = if series.mark == Mark::Line { Swatch::Line } else { Swatch::Marker };
            (series.name.clone(), Look::of(index), swatch)
        });
        legend::add(drawing, &entries.collect::<Vec<_>>(), area.left, area.top)
    }

    /// The points of series with many, under all else. Those of several series alternate: drawn one
    /// series after the other, the last would hide the first where they meet.
    fn draw_dots(&self, drawing: &mut Drawing, area: &Area, [x_span, y_span]: [&Span; 2]) {
        let mut dots = Vec::new();
        for (index, series) in self.series.iter().enumerate().filter(|(_, s)| self.is_dots(s)) {
            let share = 1.0 / series.points.len() as f64;
            for (at, point) in series.points.iter().enumerate() {
                if let (Some(x), Some(y)) = (area.x(x_span, point.x), area.y(y_span, point.y)) {
                    dots.push((share * (at as f64 + 0.5), [x, y], Look::of(index).colour));
                }
            }
        }
        dots.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, place, colour) in dots {
            drawing.disk(place, 1.75, colour, 0.45);
        }
    }

    fn is_dots(&self, series: &Series) -> bool {
        series.mark == Mark::Points && series.points.iter().filter(|p| self.holds(p)).count() > FEW
    }

    fn draw_series(
        &self,
        drawing: &mut Drawing,
        area: &Area,
        [x_span, y_span]: [&Span; 2],
        index: usize,
        series: &Series,
    ) {
        let look = Look::of(index);
        let place = |p: &Point| Some([area.x(x_span, p.x)?, area.y(y_span, p.y)?]);
        let places: Vec<_> = series.points.iter().map(place).collect();
        if series.mark == Mark::Line {
            for pair in places.windows(2) {
                if let [Some(from), Some(to)] = *pair {
                    look.line(drawing, from, to);
                }
            }
        }
        for (point, place) in series.points.iter().zip(&places) {
            let (Some(place), Some(range)) = (place, point.range) else { continue };
            let [Some(low), Some(high)] = range.map(|v| area.y(y_span, v)) else { continue };
            whisker(drawing, [[place[0], low], [place[0], high]]);
        }
        let many = places.iter().flatten().count() > FEW;
        // Of a line without neighbours only a marker can be seen, however many there are.
        for (at, place) in places.iter().enumerate() {
            let Some(place) = *place else { continue };
            let alone = [at.wrapping_sub(1), at + 1]
                .iter()
                .all(|&n| places.get(n).is_none_or(Option::is_none));
            match series.mark {
                Mark::Points if many => {}
                Mark::Line if many && !alone => {}
                Mark::Points | Mark::Line => look.marker(drawing, place, 4.0),
            }
        }
    }
}
