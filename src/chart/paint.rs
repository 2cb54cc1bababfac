//! A drawing as PNG and as SVG, both by plotters' backends and from the same items.

use super::drawing::{Drawing, Item, Place};
use super::font::{Style, backend_colour};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, DrawingBackend, DrawingErrorKind,
};
use plotters_bitmap::BitMapBackend;
use plotters_svg::SVGBackend;
use std::io;

/// Backends count whole pixels: drawn four times as large, places are exact to a quarter of a pixel.
const FACTOR: u32 = 4;
/// Most pixels of a page. Beyond, a chart is of no use, and its bitmap exhausts memory.
const MOST_PIXELS: f64 = 2e7;
/// Up to this many, a PNG is twice as large as the page, for dense screens and for print.
const DENSE_PIXELS: f64 = 4e6;
/// Text is centred on the middle of an x; moved down by this many ems, capitals and digits look it.
const OPTICAL_SHIFT: f64 = 0.05;

struct Stroke {
    width: u32,
    colour: BackendColor,
}

impl BackendStyle for Stroke {
    fn color(&self) -> BackendColor {
        self.colour
    }

    fn stroke_width(&self) -> u32 {
        self.width
    }
}

fn paint<B: DrawingBackend>(
    backend: &mut B,
    drawing: &Drawing,
    factor: u32,
) -> Result<(), DrawingErrorKind<B::ErrorType>> {
    let factor = f64::from(factor);
    let whole = |v: f64| (v * factor).round().clamp(-1e6, 1e6) as i32;
    let coord = |[x, y]: Place| -> BackendCoord { (whole(x), whole(y)) };
    for item in &drawing.items {
        match item {
            Item::Rect { from, to, colour } => {
                backend.draw_rect(coord(*from), coord(*to), &backend_colour(*colour, 1.0), true)?;
            }
            Item::Line { from, to, width, colour } => {
                // A width of 1 would take plotters' thin lines, which are not as the SVG's.
                let width = (width * factor).round().max(2.0) as u32;
                let stroke = Stroke { width, colour: backend_colour(*colour, 1.0) };
                backend.draw_line(coord(*from), coord(*to), &stroke)?;
            }
            Item::Polygon { points, colour } => {
                let points = points.iter().map(|&p| coord(p));
                backend.fill_polygon(points, &backend_colour(*colour, 1.0))?;
            }
            Item::Disk { centre, radius, colour, alpha } => {
                let colour = backend_colour(*colour, *alpha);
                backend.draw_circle(coord(*centre), whole(*radius) as u32, &colour, true)?;
            }
            Item::Text(text) => {
                let [x, y] = text.at;
                let shift = OPTICAL_SHIFT * text.size;
                let at = if text.upwards { [x + shift, y] } else { [x, y + shift] };
                backend.draw_text(&text.text, &Style { text, factor }, coord(at))?;
            }
        }
    }
    backend.present()
}

fn pixels(drawing: &Drawing) -> [u32; 2] {
    drawing.size.map(|length| length.ceil().clamp(1.0, 1e6) as u32)
}

/// Pixels of the PNG along each pixel of the page.
fn density(drawing: &Drawing) -> u32 {
    if drawing.size[0] * drawing.size[1] > DENSE_PIXELS { 1 } else { 2 }
}

/// Refuses pages that are too large to be of use.
pub(super) fn check_size(drawing: &Drawing) -> io::Result<()> {
    let [width, height] = drawing.size;
    if width * height <= MOST_PIXELS {
        return Ok(());
    }
    Err(io::Error::other(format!(
        "a chart of {width:.0}x{height:.0} pixels is too large: draw fewer groups or series in one"
    )))
}

/// The page as SVG. Texts stay texts, in the embedded font where the reader has it.
pub(super) fn svg(drawing: &Drawing) -> io::Result<String> {
    let [width, height] = pixels(drawing);
    let size = (FACTOR * width, FACTOR * height);
    let mut text = String::new();
    paint(&mut SVGBackend::with_string(&mut text, size), drawing, FACTOR)
        .map_err(|e| io::Error::other(e.to_string()))?;
    // The view box stays as drawn; what it is shown as is the page.
    let drawn = format!("<svg width=\"{}\" height=\"{}\"", size.0, size.1);
    Ok(text.replacen(&drawn, &format!("<svg width=\"{width}\" height=\"{height}\""), 1))
}

/// Width, height and pixels of the page, row by row.
pub(super) fn bitmap(drawing: &Drawing) -> io::Result<([u32; 2], Vec<u8>)> {
    let density = density(drawing);
    // Drawn twice as large and averaged: plotters smooths text, but not every edge.
    let [width, height] = pixels(drawing).map(|length| length * density);
    let mut large = vec![255; (2 * width as usize) * (2 * height as usize) * 3];
    paint(
        &mut BitMapBackend::with_buffer(&mut large, (2 * width, 2 * height)),
        drawing,
        2 * density,
    )
    .map_err(|e| io::Error::other(e.to_string()))?;
    let stride = 2 * width as usize * 3;
    let mut small = Vec::with_capacity(large.len() / 4);
    for rows in large.chunks_exact(2 * stride) {
        let (upper, lower) = rows.split_at(stride);
        for (a, b) in upper.chunks_exact(6).zip(lower.chunks_exact(6)) {
            for channel in 0..3 {
                let sum: u16 = [a[channel], a[channel + 3], b[channel], b[channel + 3]]
                    .map(u16::from)
                    .iter()
                    .sum();
                small.push(((sum + 2) / 4) as u8);
            }
        }
    }
    Ok(([width, height], small))
}
