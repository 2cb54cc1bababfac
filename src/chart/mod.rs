//! Charts as PNG and SVG: bars, lines and points, heat tables, pictures, from plain data.
//!
//! A kind of chart lays itself out as a `Drawing` in pixels, measured in the embedded font, so that
//! margins, legends and sizes follow from what is to be shown; `paint` gives the same drawing to
//! plotters' bitmap and SVG backends. The same data gives the same bits. What has no place on an axis
//! (NaN, or 0 on a logarithmic one) is a gap.

mod area;
mod axis;
mod bars;
mod drawing;
mod font;
mod heat_table;
mod legend;
mod number;
mod paint;
mod palette;
mod panels;
mod pictures;
mod xy;

#[cfg(test)]
mod tests;

pub use axis::{Axis, Scale};
pub use bars::{Bar, BarLayout, Bars, Better, Group};
pub use heat_table::HeatTable;
pub use pictures::{Picture, PictureRow, Pictures};
pub use xy::{Mark, Point, Series, Xy};

use crate::output::write_atomically;
use crate::{Error, Result};
use area::{AXIS_TITLE, LABEL, TITLE};
use drawing::{Drawing, HAlign, Text, line_height};
use image::{
    ExtendedColorType, ImageEncoder,
    codecs::png::{CompressionType, FilterType, PngEncoder},
};
use palette::{FAINT_INK, WHITE};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A chart and what is written around it.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// What it shows.
    pub title: String,
    /// What else is to be known to read it; may be empty.
    pub subtitle: String,
    /// Where it comes from: machine, command; may be empty.
    pub footnote: String,
    /// The data.
    pub body: Body,
}

/// The kinds of charts.
#[derive(Clone, Debug, PartialEq)]
pub enum Body {
    /// Bars in groups.
    Bars(Bars),
    /// Lines and points.
    Xy(Xy),
    /// A table with coloured cells.
    HeatTable(HeatTable),
    /// Small pictures in rows.
    Pictures(Pictures),
}

const MARGIN: f64 = 24.0;
/// Narrower ones would break titles into many lines.
const LEAST_WIDTH: f64 = 640.0;

impl Chart {
    /// Writes the chart as `stem.png` and `stem.svg`, side by side, and returns their paths. The PNG
    /// has two pixels for each of the SVG's, for dense screens, or one if the chart is very large.
    ///
    /// # Errors
    /// [`Error::Io`] naming the file; also of charts too large to be of use.
    pub fn write(&self, stem: &Path) -> Result<[PathBuf; 2]> {
        let page = self.page();
        let png = write_png(&page, stem)?;
        let svg = with_extension(stem, ".svg");
        let text = paint::svg(&page).map_err(Error::io(&svg))?;
        write_atomically(&svg, |out| out.write_all(text.as_bytes()))?;
        Ok([png, svg])
    }

    /// Writes `stem.png` only, for what is made of pixels anyway.
    ///
    /// # Errors
    /// As [`write`](Self::write).
    pub fn write_png(&self, stem: &Path) -> Result<PathBuf> {
        write_png(&self.page(), stem)
    }

    /// Title, subtitle, body and footnote, one below the other.
    fn page(&self) -> Drawing {
        let body = match &self.body {
            Body::Bars(bars) => bars.draw(),
            Body::Xy(xy) => xy.draw(),
            Body::HeatTable(table) => table.draw(),
            Body::Pictures(pictures) => pictures.draw(),
        };
        let width = body.size[0].max(LEAST_WIDTH).ceil();
        let mut page = Drawing::new([width + 2.0 * MARGIN, 0.0]);
        page.rect([0.0, 0.0], [0.0, 0.0], WHITE);
        let mut top = MARGIN;
        let block = |page: &mut Drawing, top: &mut f64, text: &str, size: f64| {
            if text.trim().is_empty() {
                return;
            }
            let is_title = size == TITLE;
            for line in font::wrap(text, size, is_title, width) {
                *top += line_height(size);
                let at = [MARGIN, *top - 0.5 * line_height(size)];
                let text = Text::new(at, &line, size, HAlign::Left);
                page.text(if is_title { text.bold() } else { text.colour(FAINT_INK) });
            }
        };
        block(&mut page, &mut top, &self.title, TITLE);
        if top > MARGIN {
            top += 3.0;
        }
        block(&mut page, &mut top, &self.subtitle, AXIS_TITLE);
        if top > MARGIN {
            top += 16.0;
        }
        let body_height = body.size[1];
        page.place(body, [MARGIN, top.ceil()]);
        top = top.ceil() + body_height;
        if !self.footnote.trim().is_empty() {
            top += 16.0;
            block(&mut page, &mut top, &self.footnote, LABEL);
        }
        page.size[1] = (top + MARGIN).ceil();
        let size = page.size;
        page.items[0] = drawing::Item::Rect { from: [0.0, 0.0], to: size, colour: WHITE };
        page
    }
}

/// Added, not put in place of an extension: stems may contain dots.
fn with_extension(stem: &Path, extension: &str) -> PathBuf {
    let mut name = stem.as_os_str().to_owned();
    name.push(extension);
    PathBuf::from(name)
}

fn write_png(page: &Drawing, stem: &Path) -> Result<PathBuf> {
    let png = with_extension(stem, ".png");
    paint::check_size(page).map_err(Error::io(&png))?;
    let ([width, height], pixels) = paint::bitmap(page).map_err(Error::io(&png))?;
    write_atomically(&png, |out| {
        PngEncoder::new_with_quality(out, CompressionType::Level(6), FilterType::NoFilter)
            .write_image(&pixels, width, height, ExtendedColorType::Rgb8)
            .map_err(io::Error::other)
    })?;
    Ok(png)
}
