//! Bars in panels: one for each group, the names of the series at the left of each row of panels.
//! Readable for many series with long names.

use super::area::{AXIS_TITLE, Area, BELOW_TICKS, LABEL, whisker};
use super::axis::Span;
use super::bars::{Bars, Better, Group, at_least_seen};
use super::drawing::{Drawing, HAlign, Text, line_height};
use super::font;
use super::number;
use super::palette::{BETTER, FAINT_INK, INK, STRIPE, WORSE};

/// Names are broken into lines from this width on.
const MOST_NAME: f64 = 330.0;
/// What a page should not exceed.
const PAGE: f64 = 1400.0;
const LEAST_PLOT: f64 = 210.0;
const MOST_PLOT: f64 = 520.0;
/// Between panels.
const GAP: f64 = 26.0;
/// Above a panel, for its name.
const HEADER: f64 = 28.0;

/// What all panels share.
struct Layout {
    /// Series from top to bottom.
    order: Vec<usize>,
    /// Their names, in lines.
    names: Vec<Vec<String>>,
    /// Top and bottom of each row, from the top of the first.
    rows: Vec<[f64; 2]>,
    height: f64,
    name_width: f64,
    value_width: f64,
    plot: f64,
    columns: usize,
}

impl Bars {
    pub(super) fn draw_panels(&self) -> Drawing {
        let groups: Vec<&Group> = self.groups.iter().collect();
        let print = number::printer(self.decimals, self.values());
        let layout = self.layout_panels(&print);
        let shared = self.groups.iter().flat_map(|g| self.extent_of(g)).collect::<Vec<_>>();
        let mut drawing = Drawing::default();
        let first = layout.name_width + 12.0;
        let mut top = 0.0;
        for row in groups.chunks(layout.columns) {
            let headers = row.iter().map(|g| {
                font::wrap_evenly(&g.name, AXIS_TITLE, true, layout.plot + layout.value_width)
            });
            let headers: Vec<Vec<String>> = headers.collect();
            let lines = headers.iter().map(Vec::len).max().unwrap_or(1) as f64;
            let body = top + HEADER + (lines - 1.0) * line_height(AXIS_TITLE);
            let width = first + row.len() as f64 * (layout.plot + layout.value_width + GAP) - GAP;
            for (index, [from, to]) in layout.rows.iter().enumerate() {
                if index % 2 == 0 {
                    drawing.rect([0.0, body + from], [width, body + to], STRIPE);
                }
                let at = [layout.name_width, body + 0.5 * (from + to)];
                drawing.lines(at, &layout.names[index], LABEL, HAlign::Right);
            }
            for (column, (group, header)) in row.iter().zip(&headers).enumerate() {
                let left = first + column as f64 * (layout.plot + layout.value_width + GAP);
                for (line, text) in header.iter().enumerate() {
                    let up = (header.len() - line) as f64 - 0.5;
                    let at = [left, body - 6.0 - up * line_height(AXIS_TITLE)];
                    drawing.text(Text::new(at, text, AXIS_TITLE, HAlign::Left).bold());
                }
                let area = Area {
                    left,
                    top: body,
                    right: left + layout.plot,
                    bottom: body + layout.height,
                };
                let extent = if self.own_axes { &self.extent_of(group) } else { &shared };
                self.draw_panel(&mut drawing, &layout, &area, group, extent, &print);
            }
            drawing.size[0] = drawing.size[0].max(width);
            top = body + layout.height + BELOW_TICKS + 14.0;
        }
        let room = drawing.size[0] - first;
        let title = font::wrap_evenly(&self.axis_title(), AXIS_TITLE, false, room);
        let height = title.len() as f64 * line_height(AXIS_TITLE);
        let middle = first + 0.5 * room;
        drawing.lines([middle, top - 8.0 + 0.5 * height], &title, AXIS_TITLE, HAlign::Centre);
        drawing.size[1] = top - 8.0 + height;
        drawing
    }

    fn layout_panels(&self, print: &impl Fn(f64) -> String) -> Layout {
        let order = self.panel_order();
        let names: Vec<Vec<String>> =
            order.iter().map(|&s| font::wrap(&self.series[s], LABEL, false, MOST_NAME)).collect();
        let width = |text: &String| font::width(text, LABEL, false);
        let name_width = names.iter().flatten().map(width).fold(0.0, f64::max).ceil() + 6.0;
        let value_width =
            self.values().map(|v| font::width(&print(v), LABEL, true)).fold(0.0, f64::max) + 10.0;
        let mut height = 0.0;
        let rows = names
            .iter()
            .map(|lines| {
                let top = height;
                height += lines.len() as f64 * line_height(LABEL) + 7.0;
                [top, height]
            })
            .collect();
        let room = PAGE - name_width - 12.0 + GAP;
        let fit = (room / (LEAST_PLOT + value_width + GAP)).floor().max(1.0) as usize;
        // As many rows of panels as needed, and no row much shorter than another.
        let count = self.groups.len().max(1);
        let columns = count.div_ceil(count.div_ceil(fit.min(4)));
        let plot = (room / columns as f64 - value_width - GAP).clamp(LEAST_PLOT, MOST_PLOT).floor();
        Layout { order, names, rows, height, name_width, value_width, plot, columns }
    }

    /// The series from top to bottom.
    fn panel_order(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.series.len()).collect();
        if !self.sorted {
            return order;
        }
        // By places, not by values: a group with large values would outweigh the others.
        let sign = if self.better == Better::Lower { 1.0 } else { -1.0 };
        let mut places = vec![Vec::new(); order.len()];
        for group in &self.groups {
            let value = |s: usize| group.bar(s, &self.axis).map(|bar| sign * bar.value);
            let mut ranked: Vec<usize> =
                order.iter().copied().filter(|&s| value(s).is_some()).collect();
            ranked.sort_by(|&a, &b| value(a).partial_cmp(&value(b)).expect("values are numbers"));
            for (place, &series) in ranked.iter().enumerate() {
                places[series].push(place);
            }
        }
        // Twice the median; series without a value come last.
        let median = |places: &mut Vec<usize>| {
            places.sort_unstable();
            let count = places.len();
            if count == 0 { usize::MAX } else { places[count / 2] + places[(count - 1) / 2] }
        };
        let medians: Vec<usize> = places.iter_mut().map(median).collect();
        order.sort_by_key(|&s| medians[s]);
        order
    }

    fn draw_panel(
        &self,
        drawing: &mut Drawing,
        layout: &Layout,
        area: &Area,
        group: &Group,
        extent: &[f64],
        print: &impl Fn(f64) -> String,
    ) {
        let Some((span, base)) = Span::for_bars(&self.axis, extent.iter().copied()) else {
            let at = [0.5 * (area.left + area.right), 0.5 * (area.top + area.bottom)];
            drawing.text(Text::new(at, "no data to show", LABEL, HAlign::Centre).colour(FAINT_INK));
            return;
        };
        let ticks = span.ticks((layout.plot / 46.0) as usize);
        area.x_ticks(drawing, &span, &ticks);
        let x = |value| area.x(&span, value);
        let zero = x(base).unwrap_or(area.left);
        let best = self.best(group);
        for (&series, [from, to]) in layout.order.iter().zip(&layout.rows) {
            let middle = area.top + 0.5 * (from + to);
            let Some(bar) = group.bar(series, &self.axis) else {
                let at = [area.right + layout.value_width, middle];
                drawing.text(Text::new(at, "–", LABEL, HAlign::Right).colour(FAINT_INK));
                continue;
            };
            let Some(end) = x(bar.value) else { continue };
            let (left, right) = at_least_seen(end.min(zero), end.max(zero));
            let colour = if self.is_worse(bar.value) { WORSE } else { BETTER };
            drawing.rect([left, middle - 6.5], [right, middle + 6.5], colour);
            if let Some([Some(low), Some(high)]) = bar.range.map(|r| r.map(x)) {
                whisker(drawing, [[low, middle], [high, middle]]);
            }
            let at = [area.right + layout.value_width, middle];
            let text = Text::new(at, &print(bar.value), LABEL, HAlign::Right);
            drawing.text(if best == Some(bar.value) { text.bold() } else { text });
        }
        drawing.vertical(zero, [area.top, area.bottom], INK);
        drawing.horizontal([area.left, area.right], area.bottom, FAINT_INK);
    }

    /// Whether a value lies on the wrong side of the reference. Where neither side is wrong, those
    /// below get the other colour.
    fn is_worse(&self, value: f64) -> bool {
        self.axis.usable_reference().is_some_and(|reference| match self.better {
            Better::Lower => value > reference,
            Better::Higher | Better::Neither => value < reference,
        })
    }
}
