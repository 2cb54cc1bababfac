//! Bars: one value for each series in each group (an order on a scene, say).

use super::area::{Area, BELOW_TICKS, LABEL, nothing, whisker};
use super::axis::{Axis, Span};
use super::drawing::{Drawing, HAlign, Text, line_height};
use super::font;
use super::legend::{self, Swatch};
use super::number;
use super::palette::{GRID, INK, Look};

/// A bar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bar {
    /// Its end. A value without a place on the axis, such as NaN, is a gap.
    pub value: f64,
    /// The least and the largest of several measurements, drawn as whiskers.
    pub range: Option<[f64; 2]>,
}

impl From<f64> for Bar {
    fn from(value: f64) -> Self {
        Self { value, range: None }
    }
}

/// The bars of one group, one for each series; those that lack at the end are gaps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Group {
    /// What it is called.
    pub name: String,
    /// In the order of the series.
    pub bars: Vec<Bar>,
}

impl Group {
    /// A group of bars.
    pub fn new<B: Into<Bar>>(name: impl Into<String>, bars: impl IntoIterator<Item = B>) -> Self {
        Self { name: name.into(), bars: bars.into_iter().map(Into::into).collect() }
    }

    /// The bar of a series, if it has a place on the axis.
    pub(super) fn bar(&self, series: usize, axis: &Axis) -> Option<Bar> {
        self.bars.get(series).copied().filter(|bar| axis.scale.holds(bar.value))
    }
}

/// How bars are laid out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BarLayout {
    /// Side by side if there are few, else panels.
    #[default]
    Auto,
    /// A panel for each group, bars from left to right, names of the series at the left.
    Panels,
    /// Groups beside each other, bars from bottom to top, series told apart by colour.
    SideBySide,
}

/// Which values are good. Says so in the axis title, colours bars by it if there is a reference, and
/// prints the best value of each group bold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Better {
    /// Large ones.
    Higher,
    /// Small ones.
    Lower,
    /// Neither.
    #[default]
    Neither,
}

/// A chart of bars.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bars {
    /// The axis of the values. Bars grow from its reference if it has one: for ratios, from 1.
    pub axis: Axis,
    /// Names of the series.
    pub series: Vec<String>,
    /// The bars.
    pub groups: Vec<Group>,
    /// How they are laid out.
    pub layout: BarLayout,
    /// Which values are good.
    pub better: Better,
    /// In panels: the same best series first in all, by the median of its places in the groups.
    pub sorted: bool,
    /// In panels: an axis of its own for each group, for values that are not to be compared between
    /// groups.
    pub own_axes: bool,
    /// Decimals of printed values; by default three digits.
    pub decimals: Option<usize>,
}

/// More series than this are not told apart by colour with ease.
const FEW_SERIES: usize = 5;
const FEW_BARS: usize = 30;

impl Bars {
    pub(super) fn draw(&self) -> Drawing {
        if self.series.is_empty() || self.values().next().is_none() {
            return nothing();
        }
        let few =
            self.series.len() <= FEW_SERIES && self.series.len() * self.groups.len() <= FEW_BARS;
        match self.layout {
            BarLayout::SideBySide => self.draw_side_by_side(),
            BarLayout::Auto if few => self.draw_side_by_side(),
            BarLayout::Auto | BarLayout::Panels => self.draw_panels(),
        }
    }

    /// Every value that has a place on the axis.
    pub(super) fn values(&self) -> impl Iterator<Item = f64> {
        self.groups.iter().flat_map(|g| self.values_of(g))
    }

    /// Those of a group.
    pub(super) fn values_of(&self, group: &Group) -> impl Iterator<Item = f64> {
        (0..self.series.len()).filter_map(|s| group.bar(s, &self.axis)).map(|bar| bar.value)
    }

    /// Those of a group, with the ends of whiskers.
    pub(super) fn extent_of(&self, group: &Group) -> Vec<f64> {
        let bars = (0..self.series.len()).filter_map(|s| group.bar(s, &self.axis));
        bars.flat_map(|bar| std::iter::once(bar.value).chain(bar.range.into_iter().flatten()))
            .collect()
    }

    /// The best value of a group.
    pub(super) fn best(&self, group: &Group) -> Option<f64> {
        match self.better {
            Better::Higher => self.values_of(group).reduce(f64::max),
            Better::Lower => self.values_of(group).reduce(f64::min),
            Better::Neither => None,
        }
    }

    /// The title of the axis.
    pub(super) fn axis_title(&self) -> String {
        let hint = match self.better {
            Better::Higher => "higher is better",
            Better::Lower => "lower is better",
            Better::Neither => return self.axis.title.clone(),
        };
        match self.axis.title.as_str() {
            "" => hint.into(),
            title => format!("{title}, {hint}"),
        }
    }

    fn draw_side_by_side(&self) -> Drawing {
        const HEIGHT: f64 = 420.0;
        let extent = self.groups.iter().flat_map(|g| self.extent_of(g));
        let Some((mut span, base)) = Span::for_bars(&self.axis, extent) else {
            return nothing();
        };
        let print = number::printer(self.decimals, self.values());
        let widest = self.values().map(|v| font::width(&print(v), LABEL, true)).fold(0.0, f64::max);

        // Wide enough for the values over the bars if they are few, else for values read upwards.
        let count = self.series.len() as f64;
        let (bar, upwards) = match self.groups.len() * self.series.len() {
            ..=16 => ((widest + 6.0).max(34.0), false),
            _ => (19.0, true),
        };
        let words = self.groups.iter().flat_map(|g| g.name.split(' '));
        let word = words.map(|w| font::width(w, LABEL, false)).fold(0.0, f64::max).min(150.0);
        let slot = (count * bar + 28.0).max(word + 16.0);
        let label_room = (8.0 + if upwards { widest } else { LABEL }) / HEIGHT;
        // Bars below the base have their values below them.
        let has_low = self.values().any(|v| v < base);
        span.widen([if has_low { label_room } else { 0.0 }, label_room]);

        let title = self.axis_title();
        let ticks = span.ticks(7);
        let [labels, reach] = Area::y_reach(&title, HEIGHT, &ticks);
        let width = (slot * self.groups.len() as f64).max(420.0);
        let slot = width / self.groups.len() as f64;
        let area = Area { left: reach, top: 6.0, right: reach + width, bottom: 6.0 + HEIGHT };
        let mut drawing = Drawing::default();
        area.y_ticks(&mut drawing, &span, &ticks);
        area.y_title(&mut drawing, &title, labels);
        let y = |value| area.y(&span, value);
        let zero = y(base).unwrap_or(area.bottom);
        let mut names_height: f64 = 0.0;
        for (index, group) in self.groups.iter().enumerate() {
            let middle = area.left + slot * (index as f64 + 0.5);
            if index > 0 {
                let edge = area.left + slot * index as f64;
                drawing.vertical(edge, [area.top, area.bottom], GRID);
            }
            let best = self.best(group);
            for series in 0..self.series.len() {
                let Some(item) = group.bar(series, &self.axis) else { continue };
                let Some(end) = y(item.value) else { continue };
                let left = middle + bar * (series as f64 - 0.5 * count);
                let (top, bottom) = at_least_seen(end.min(zero), end.max(zero));
                let (from, to) = ([left + 1.5, top], [left + bar - 1.5, bottom]);
                Look::of(series).bar(&mut drawing, from, to);
                let mut ends = [top, bottom];
                if let Some([Some(low), Some(high)]) = item.range.map(|r| r.map(y)) {
                    let centre = left + 0.5 * bar;
                    whisker(&mut drawing, [[centre, low], [centre, high]]);
                    ends = [top.min(high), bottom.max(low)];
                }
                let text = print(item.value);
                let half =
                    4.0 + 0.5 * if upwards { font::width(&text, LABEL, true) } else { LABEL };
                let below = item.value < base;
                let label_y = if below { ends[1] + half } else { ends[0] - half };
                let at = [left + 0.5 * bar, label_y];
                let mut text = Text::new(at, &text, LABEL, HAlign::Centre);
                if upwards {
                    text = text.upwards();
                }
                drawing.text(if best == Some(item.value) { text.bold() } else { text });
            }
            let lines = font::wrap_evenly(&group.name, LABEL, false, slot - 10.0);
            let height = lines.len() as f64 * line_height(LABEL);
            let at = [middle, area.bottom + 8.0 + 0.5 * height];
            drawing.lines(at, &lines, LABEL, HAlign::Centre);
            names_height = names_height.max(height);
        }
        area.frame(&mut drawing);
        if self.axis.usable_reference().is_some() || zero < area.bottom - 1.0 {
            drawing.horizontal([area.left, area.right], zero, INK);
        }
        let below = (8.0 + names_height).max(BELOW_TICKS);
        drawing.size = [area.right + 2.0, area.bottom + below + 2.0];
        let entries: Vec<_> = self
            .series
            .iter()
            .enumerate()
            .map(|(index, name)| (name.clone(), Look::of(index), Swatch::Bar))
            .collect();
        legend::add(drawing, &entries, area.left, area.top)
    }
}

/// A bar from here to there, grown to be seen.
pub(super) fn at_least_seen(low: f64, high: f64) -> (f64, f64) {
    let missing = (2.0 - (high - low)).max(0.0);
    (low - 0.5 * missing, high + 0.5 * missing)
}
