//! A table of numbers whose cells are coloured by value.

use super::area::{AXIS_TITLE, LABEL, nothing};
use super::axis::{Axis, Scale, Span};
use super::drawing::{Colour, Drawing, HAlign, Text, line_height};
use super::font;
use super::number;
use super::palette::{FAINT_INK, MISSING, between, ink_on};

/// A table of numbers with coloured cells.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HeatTable {
    /// Of the values. With a reference, colours diverge from white there: blue above, orange below,
    /// and steps of equal length (equal factors on a logarithmic axis) are equally strong. Without,
    /// they go from light to dark.
    pub axis: Axis,
    /// What rows are; may be empty.
    pub row_title: String,
    /// Names of the rows.
    pub rows: Vec<String>,
    /// What columns are; may be empty.
    pub column_title: String,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Values, row by row. Missing ones and such that are not finite leave an empty cell.
    pub values: Vec<Vec<f64>>,
    /// Decimals of printed values; by default three digits.
    pub decimals: Option<usize>,
}

const ABOVE: [Colour; 5] =
    [[255, 255, 255], [209, 229, 240], [146, 197, 222], [67, 147, 195], [33, 102, 172]];
const BELOW: [Colour; 5] =
    [[255, 255, 255], [254, 224, 182], [253, 184, 99], [224, 130, 20], [179, 88, 6]];
const DARKER: [Colour; 5] =
    [[247, 251, 255], [198, 219, 239], [107, 174, 214], [33, 113, 181], [8, 48, 107]];

const CELL_HEIGHT: f64 = 28.0;
const MOST_ROW_NAME: f64 = 380.0;
const MOST_COLUMN_NAME: f64 = 132.0;

/// Values as colours.
struct Map {
    span: Span,
    /// Where the reference lies in the span.
    centre: Option<f64>,
}

impl Map {
    fn colour(&self, value: f64) -> Option<Colour> {
        Some(self.at(self.span.part(value)?))
    }

    fn at(&self, part: f64) -> Colour {
        let Some(centre) = self.centre else { return between(&DARKER, part) };
        // As strong on both sides, so that colours can be compared.
        let distance = (part - centre) / centre.max(1.0 - centre);
        if distance < 0.0 { between(&BELOW, -distance) } else { between(&ABOVE, distance) }
    }
}

impl HeatTable {
    fn value(&self, row: usize, column: usize) -> Option<f64> {
        let value = *self.values.get(row)?.get(column)?;
        value.is_finite().then_some(value)
    }

    pub(super) fn draw(&self) -> Drawing {
        let cells = || {
            (0..self.rows.len())
                .flat_map(move |row| (0..self.columns.len()).map(move |column| (row, column)))
        };
        let values = || cells().filter_map(|(row, column)| self.value(row, column));
        let Some(span) = Span::around(&self.axis, values()) else { return nothing() };
        let centre = self.axis.usable_reference().and_then(|v| span.part(v));
        let map = Map { span, centre };
        let print = number::printer(self.decimals, values());
        let value_width =
            values().map(|v| font::width(&print(v), LABEL, false)).fold(0.0, f64::max);
        let wrap = |names: &[String], most| -> Vec<Vec<String>> {
            names.iter().map(|name| font::wrap_evenly(name, LABEL, false, most)).collect()
        };
        let widest = |names: &[Vec<String>]| {
            names.iter().flatten().map(|t| font::width(t, LABEL, false)).fold(0.0, f64::max)
        };
        let rows = wrap(&self.rows, MOST_ROW_NAME);
        let columns = wrap(&self.columns, MOST_COLUMN_NAME);
        let cell = (widest(&columns) + 14.0).max(value_width + 20.0).max(64.0).ceil();
        let title_width = font::width(&self.row_title, LABEL, true);
        let left = (widest(&rows).max(title_width) + 12.0).ceil();
        let right = left + cell * columns.len() as f64;

        let mut drawing = Drawing::default();
        let step = line_height(LABEL);
        let mut top = 0.0;
        if !self.column_title.is_empty() {
            let at = [0.5 * (left + right), 0.5 * step];
            drawing.text(Text::new(at, &self.column_title, LABEL, HAlign::Centre).bold());
            top += step + 6.0;
        }
        let head = columns.iter().map(Vec::len).max().unwrap_or(1) as f64 * step;
        for (column, lines) in columns.iter().enumerate() {
            let middle = left + cell * (column as f64 + 0.5);
            // On the line of the table's top.
            let centre = top + head - 0.5 * step * lines.len() as f64;
            drawing.lines([middle, centre], lines, LABEL, HAlign::Centre);
        }
        let at = [left - 10.0, top + head - 0.5 * step];
        drawing.text(Text::new(at, &self.row_title, LABEL, HAlign::Right).bold());
        top += head + 6.0;
        let table_top = top;
        for (row, lines) in rows.iter().enumerate() {
            let height = CELL_HEIGHT.max(lines.len() as f64 * step + 8.0);
            let middle = top + 0.5 * height;
            drawing.lines([left - 10.0, middle], lines, LABEL, HAlign::Right);
            for column in 0..columns.len() {
                let x = left + cell * column as f64;
                let value = self.value(row, column);
                let ground = value.and_then(|v| map.colour(v)).unwrap_or(MISSING);
                let text = value.map_or_else(|| "–".into(), &print);
                drawing.rect([x + 1.0, top + 1.0], [x + cell - 1.0, top + height - 1.0], ground);
                let text = Text::new([x + 0.5 * cell, middle], &text, LABEL, HAlign::Centre);
                drawing.text(text.colour(ink_on(ground)));
            }
            top += height;
        }
        drawing.size = [right, top];
        self.key(&mut drawing, &map, [right, table_top]);
        drawing
    }

    /// The colours and what they mean, at the right of the table.
    fn key(&self, drawing: &mut Drawing, map: &Map, [table_right, top]: [f64; 2]) {
        let height = (drawing.size[1] - top).clamp(150.0, 320.0);
        let left = table_right + 28.0;
        let steps = height as usize / 2;
        for step in 0..steps {
            let part = 1.0 - (step as f64 + 0.5) / steps as f64;
            let y = top + 2.0 * step as f64;
            drawing.rect([left, y], [left + 16.0, y + 2.0], map.at(part));
        }
        for x in [left, left + 16.0] {
            drawing.vertical(x, [top, top + height - 1.0], FAINT_INK);
        }
        for y in [top, top + height - 1.0] {
            drawing.horizontal([left, left + 16.0], y, FAINT_INK);
        }
        let mut widest: f64 = 0.0;
        let mut occupied = f64::INFINITY;
        for tick in map.span.ticks(if self.axis.scale == Scale::Log { 6 } else { 5 }) {
            let Some(part) = map.span.part(tick.value) else { continue };
            let y = top + height * (1.0 - part);
            if tick.label.is_empty() || y + LABEL > occupied {
                continue;
            }
            occupied = y;
            drawing.horizontal([left + 16.0, left + 20.0], y, FAINT_INK);
            drawing.text(Text::new([left + 25.0, y], &tick.label, LABEL, HAlign::Left));
            widest = widest.max(font::width(&tick.label, LABEL, false));
        }
        drawing.size = [left + 25.0 + widest, drawing.size[1].max(top + height)];
        if !self.axis.title.is_empty() {
            let lines = font::wrap_evenly(&self.axis.title, AXIS_TITLE, false, height.max(150.0));
            let mut x = drawing.size[0] + 14.0;
            for line in &lines {
                let at = [x, top + 0.5 * height];
                drawing.text(Text::new(at, line, AXIS_TITLE, HAlign::Centre).upwards());
                x += line_height(AXIS_TITLE);
            }
            drawing.size[0] = x - line_height(AXIS_TITLE) + 9.0;
        }
    }
}
