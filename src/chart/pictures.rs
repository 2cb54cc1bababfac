//! Small pictures in rows, one below the other in columns that have names: strips to be compared.

use super::area::{AXIS_TITLE, LABEL};
use super::drawing::{Drawing, HAlign, Text, line_height};
use super::font;
use super::palette::FAINT_INK;

/// Rows of pictures.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pictures {
    /// The name of each column.
    pub columns: Vec<String>,
    /// From the top.
    pub rows: Vec<PictureRow>,
    /// Side of a pixel on the page.
    pub zoom: u32,
}

/// A row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PictureRow {
    /// What its pictures have in common, written above them.
    pub title: String,
    /// One for each column; `None` leaves it empty.
    pub pictures: Vec<Option<Picture>>,
}

/// A picture and what is written below it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// sRGB, row by row from the upper left.
    pub pixels: Vec<[u8; 3]>,
    /// Lines below it.
    pub caption: Vec<String>,
}

const GAP: f64 = 14.0;
/// Columns of tiny pictures have room for their names.
const LEAST_WIDTH: f64 = 150.0;

impl Pictures {
    pub(super) fn draw(&self) -> Drawing {
        let zoom = f64::from(self.zoom.max(1));
        let pictures = || self.rows.iter().flat_map(|row| row.pictures.iter().flatten());
        let largest =
            |axis: usize| pictures().map(|p| zoom * f64::from(p.size[axis])).fold(0.0, f64::max);
        let (column, height) = (largest(0).max(LEAST_WIDTH), largest(1));
        let left = |index: usize| index as f64 * (column + GAP);
        let mut drawing = Drawing::default();
        let names: Vec<Vec<String>> =
            self.columns.iter().map(|name| font::wrap(name, AXIS_TITLE, true, column)).collect();
        let name_lines = names.iter().map(Vec::len).max().unwrap_or(0);
        for (index, lines) in names.iter().enumerate() {
            // Names end at the same height, next to their pictures.
            for (row, line) in lines.iter().enumerate() {
                let down = (name_lines - lines.len() + row) as f64 + 0.5;
                let at = [left(index), down * line_height(AXIS_TITLE)];
                drawing.text(Text::new(at, line, AXIS_TITLE, HAlign::Left).bold());
            }
        }
        let mut top = name_lines as f64 * line_height(AXIS_TITLE) + 4.0;
        for row in &self.rows {
            if !row.title.trim().is_empty() {
                top += line_height(LABEL);
                let at = [0.0, top - 0.5 * line_height(LABEL)];
                drawing.text(Text::new(at, &row.title, LABEL, HAlign::Left).colour(FAINT_INK));
                top += 3.0;
            }
            let mut caption_lines = 0;
            for (index, picture) in row.pictures.iter().enumerate() {
                let Some(picture) = picture else { continue };
                draw_pixels(&mut drawing, picture, [left(index), top], zoom);
                let bottom = top + height + 4.0;
                for (line, text) in picture.caption.iter().enumerate() {
                    let at = [left(index), bottom + (line as f64 + 0.5) * line_height(LABEL)];
                    drawing.text(Text::new(at, text, LABEL, HAlign::Left));
                }
                caption_lines = caption_lines.max(picture.caption.len());
            }
            top += height + 4.0 + caption_lines as f64 * line_height(LABEL) + GAP;
        }
        let columns =
            self.columns.len().max(self.rows.iter().map(|r| r.pictures.len()).max().unwrap_or(0));
        drawing.size = [left(columns) - GAP.min(left(columns)), (top - GAP).max(1.0)];
        drawing
    }
}

/// Runs of equal pixels as rectangles.
fn draw_pixels(drawing: &mut Drawing, picture: &Picture, [left, top]: [f64; 2], zoom: f64) {
    let width = picture.size[0] as usize;
    for (y, row) in picture.pixels.chunks_exact(width.max(1)).enumerate() {
        let mut x = 0;
        for run in row.chunk_by(|a, b| a == b) {
            let from = [left + zoom * x as f64, top + zoom * y as f64];
            let to = [from[0] + zoom * run.len() as f64, from[1] + zoom];
            drawing.rect(from, to, run[0]);
            x += run.len();
        }
    }
}
