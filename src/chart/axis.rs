//! Axes: what they say, the span of their values, their ticks.

use super::number;

/// How values are spread along an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Equal steps are equally long.
    #[default]
    Linear,
    /// Equal factors are equally long. Values that are not positive are gaps.
    Log,
}

/// An axis of values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// What it shows, with the unit: `order time [ms]`.
    pub title: String,
    /// How values are spread.
    pub scale: Scale,
    /// A value to be marked by a line. Bars grow from it.
    pub reference: Option<f64>,
}

impl Axis {
    /// A linear axis.
    pub fn linear(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    /// A logarithmic axis.
    pub fn log(title: impl Into<String>) -> Self {
        Self { scale: Scale::Log, ..Self::linear(title) }
    }

    /// Marks a value.
    #[must_use]
    pub fn with_reference(self, value: f64) -> Self {
        Self { reference: Some(value), ..self }
    }

    /// The reference, if the scale has a place for it.
    pub(super) fn usable_reference(&self) -> Option<f64> {
        self.reference.filter(|&v| self.scale.holds(v))
    }
}

impl Scale {
    /// Whether the value has a place on such an axis. What is so large that a difference overflows
    /// has none.
    pub(super) fn holds(self, value: f64) -> bool {
        match self {
            Self::Linear => value.abs() < 1e300,
            Self::Log => (1e-300..1e300).contains(&value),
        }
    }

    /// Along which the axis is even.
    fn along(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Log => value.log10(),
        }
    }

    fn back(self, along: f64) -> f64 {
        match self {
            Self::Linear => along,
            Self::Log => 10_f64.powf(along),
        }
    }
}

/// A line across the axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    pub(super) value: f64,
    /// Empty at lines between labelled ones.
    pub(super) label: String,
}

/// The values that an axis shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Span {
    scale: Scale,
    /// Ends, along the axis (logarithms if it is logarithmic).
    ends: [f64; 2],
}

impl Span {
    /// Around all `values` that have a place on the axis, with a little room; none if no value has.
    pub(super) fn around(axis: &Axis, values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let scale = axis.scale;
        let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
        let mut widen = |along: f64| ends = [ends[0].min(along), ends[1].max(along)];
        let mut any = false;
        for value in values.into_iter().filter(|&v| scale.holds(v)) {
            widen(scale.along(value));
            any = true;
        }
        if !any {
            return None;
        }
        if let Some(reference) = axis.usable_reference() {
            widen(scale.along(reference));
        }
        let magnitude = ends[0].abs().max(ends[1].abs());
        // Of a single value, and of values that differ by rounding only.
        let least = match scale {
            Scale::Linear if magnitude == 0.0 => 1.0,
            Scale::Linear => 1e-6 * magnitude,
            Scale::Log => 0.01,
        };
        let length = ends[1] - ends[0];
        let room = if length < least {
            if scale == Scale::Log { 0.15 } else { 0.1 * magnitude.max(f64::MIN_POSITIVE) }
        } else {
            0.05 * length
        };
        let room = if magnitude == 0.0 && scale == Scale::Linear { 1.0 } else { room };
        Some(Self { scale, ends: [ends[0] - room, ends[1] + room] })
    }

    /// For bars: around all values and the line that bars grow from, which is also returned: the
    /// reference, else 0, else, as a logarithmic axis has no 0, its end.
    pub(super) fn for_bars(
        axis: &Axis,
        values: impl IntoIterator<Item = f64>,
    ) -> Option<(Self, f64)> {
        let values: Vec<f64> = values.into_iter().filter(|&v| axis.scale.holds(v)).collect();
        let mut span = Self::around(axis, values.iter().copied())?;
        if let Some(reference) = axis.usable_reference() {
            return Some((span, reference));
        }
        if axis.scale == Scale::Log {
            // The least bar is to be seen: from the half of it, rounded down, to one digit.
            let half = 0.5 * values.iter().copied().fold(f64::INFINITY, f64::min);
            let unit = 10_f64.powf(half.log10().floor());
            span.ends[0] = ((half / unit).floor().max(1.0) * unit).log10();
            return Some((span, span.scale.back(span.ends[0])));
        }
        let ends = [0.0_f64; 2];
        let [low, high] = values.iter().fold(ends, |[a, b], &v| [a.min(v), b.max(v)]);
        span.ends = match (low < 0.0, high > 0.0) {
            (false, false) => [0.0, 1.0],
            (low_room, high_room) => {
                let room = 0.05 * (high - low);
                [if low_room { low - room } else { 0.0 }, if high_room { high + room } else { 0.0 }]
            }
        };
        Some((span, 0.0))
    }

    /// Adds these parts of the length at the ends.
    pub(super) fn widen(&mut self, [low, high]: [f64; 2]) {
        let length = self.ends[1] - self.ends[0];
        self.ends = [self.ends[0] - low * length, self.ends[1] + high * length];
    }

    /// Where the value lies: 0 at the low end, 1 at the high end.
    pub(super) fn part(&self, value: f64) -> Option<f64> {
        let [low, high] = self.ends;
        self.scale.holds(value).then(|| (self.scale.along(value) - low) / (high - low))
    }

    /// Ticks at round values within the span, about `most` of them with labels.
    pub(super) fn ticks(&self, most: usize) -> Vec<Tick> {
        let [low, high] = self.ends;
        let decades = high - low;
        match self.scale {
            Scale::Log if decades > 0.8 => self.log_ticks(most),
            Scale::Log => linear_ticks([10_f64.powf(low), 10_f64.powf(high)], most),
            Scale::Linear => linear_ticks([low, high], most),
        }
    }

    fn log_ticks(&self, most: usize) -> Vec<Tick> {
        let [low, high] = self.ends;
        let decades = high - low;
        let labelled: &[u32] = match most as f64 / decades {
            room if room >= 3.0 => &[1, 2, 5],
            room if room >= 2.0 => &[1, 3],
            _ => &[1],
        };
        let step = (decades / most as f64).ceil().max(1.0) as i32;
        let mut ticks = Vec::new();
        for exponent in low.floor() as i32..=high.floor() as i32 {
            for digit in 1..10 {
                // Lines between decades are too close for more than a few of these.
                let is_labelled = labelled.contains(&digit) && exponent % step == 0;
                let is_shown = match digit {
                    1 => decades <= 40.0,
                    _ => decades <= 4.5,
                };
                if !is_labelled && !is_shown {
                    continue;
                }
                let value = f64::from(digit) * 10_f64.powi(exponent);
                let along = value.log10();
                if along >= low - 1e-9 && along <= high + 1e-9 {
                    let label = if is_labelled { number::round(value) } else { String::new() };
                    ticks.push(Tick { value, label });
                }
            }
        }
        ticks
    }
}

fn linear_ticks([low, high]: [f64; 2], most: usize) -> Vec<Tick> {
    let rough = (high - low) / most.max(1) as f64;
    let unit = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * unit).into_iter().find(|&s| s >= 0.999 * rough);
    let step = step.unwrap_or(10.0 * unit);
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    let tolerance = 1e-6 * (high - low);
    let first = ((low - tolerance) / step).ceil();
    (0..=2 * most + 2)
        .map(|i| (first + i as f64) * step)
        .take_while(|&value| value <= high + tolerance)
        .map(|value| {
            let largest = low.abs().max(high.abs());
            let label = if decimals > 6 || largest >= 1e7 {
                number::three_digits(if value.abs() < 0.5 * step { 0.0 } else { value })
            } else {
                number::fixed(value, decimals)
            };
            Tick { value, label }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(span: Span, most: usize) -> Vec<String> {
        span.ticks(most).into_iter().map(|t| t.label).filter(|l| !l.is_empty()).collect()
    }

    #[test]
    fn ticks_are_round_and_within() {
        let span = Span::around(&Axis::linear(""), [0.6, 2.4]).unwrap();
        assert_eq!(labels(span, 5), ["1.0", "1.5", "2.0"]);
        assert_eq!(
            labels(span, 10),
            ["0.6", "0.8", "1.0", "1.2", "1.4", "1.6", "1.8", "2.0", "2.2", "2.4"]
        );
        let span = Span::around(&Axis::log(""), [0.01, 800.0]).unwrap();
        assert_eq!(labels(span, 6), ["0.01", "0.1", "1", "10", "100", "1000"]);
        let span = Span::around(&Axis::log(""), [0.7, 8.0]).unwrap();
        assert_eq!(labels(span, 6), ["1", "2", "5"]);
    }

    #[test]
    fn odd_values_have_no_place_and_do_no_harm() {
        assert_eq!(Span::around(&Axis::log(""), [0.0, -1.0, f64::NAN]), None);
        assert_eq!(Span::around(&Axis::linear(""), [f64::INFINITY]), None);
        let extremes: [&[f64]; 8] = [
            &[0.0],
            &[1.0],
            &[-3.0, -3.0],
            &[1e9, 1e9 + 1e-7],
            &[-1e299, 1e299],
            &[1e-299],
            &[1e-299, 1e299],
            &[1.0, f64::NAN],
        ];
        for values in extremes {
            for axis in [Axis::linear(""), Axis::log(""), Axis::log("").with_reference(1.0)] {
                let spans = [
                    Span::around(&axis, values.iter().copied()),
                    Span::for_bars(&axis, values.iter().copied()).map(|bars| bars.0),
                ];
                for span in spans.into_iter().flatten() {
                    let ticks = span.ticks(8);
                    assert!((1..100).contains(&ticks.len()), "{values:?}: {}", ticks.len());
                    for tick in ticks {
                        let part = span.part(tick.value).unwrap();
                        assert!((-1e-5..1.00001).contains(&part), "{values:?}: {part}");
                    }
                }
            }
        }
    }

    #[test]
    fn bars_start_where_they_should() {
        let values = [0.5, 2.0, f64::NAN];
        assert_eq!(Span::for_bars(&Axis::linear(""), values).unwrap().1, 0.0);
        let (span, base) = Span::for_bars(&Axis::log(""), values).unwrap();
        assert!((base - 0.2).abs() < 1e-9 && span.part(base).unwrap().abs() < 1e-9, "{base}");
        let axis = Axis::linear("").with_reference(1.0);
        assert_eq!(Span::for_bars(&axis, values).unwrap().1, 1.0);
    }
}
