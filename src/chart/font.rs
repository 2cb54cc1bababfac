//! Text in the embedded font, DejaVu Sans: its widths, its lines, its pixels. Nothing of the system's
//! fonts is used, so that a chart is laid out and drawn the same everywhere.

use super::drawing::{Colour, HAlign, Text};
use ab_glyph::{Font, FontRef, GlyphId, PxScale, ScaleFont, point};
use plotters_backend::text_anchor::{HPos, Pos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendTextStyle, FontFamily, FontStyle, FontTransform,
};
use std::convert::Infallible;
use std::sync::OnceLock;

/// What an SVG asks for: the embedded font, one that is as wide, any.
const FAMILY: &str = "DejaVu Sans, Verdana, sans-serif";
/// Height of an `x` in ems, on whose middle plotters' SVG text is centred.
const X_HEIGHT: f64 = 0.547;
/// plotters writes SVG text at this part of the size that it is given.
const PLOTTERS_SIZE: f64 = 1.24;

fn face(bold: bool) -> &'static FontRef<'static> {
    static FACES: OnceLock<[FontRef<'static>; 2]> = OnceLock::new();
    let faces = FACES.get_or_init(|| {
        [dejavu::sans::regular(), dejavu::sans::bold()]
            .map(|bytes| FontRef::try_from_slice(bytes).expect("the embedded font is valid"))
    });
    &faces[usize::from(bold)]
}

/// Each glyph of `text` and where its pen stands, in pixels, and where the pen ends.
fn pens(text: &str, size: f64, bold: bool) -> (Vec<(GlyphId, f32)>, f32) {
    let font = face(bold).as_scaled(scale(size, bold));
    let mut pen = 0.0;
    let mut glyphs: Vec<(GlyphId, f32)> = Vec::with_capacity(text.len());
    for id in text.chars().map(|c| font.glyph_id(c)) {
        if let Some(&(last, _)) = glyphs.last() {
            pen += font.kern(last, id);
        }
        glyphs.push((id, pen));
        pen += font.h_advance(id);
    }
    (glyphs, pen)
}

/// ab_glyph's scale, a line's height, for an em of `size` pixels.
fn scale(size: f64, bold: bool) -> PxScale {
    let font = face(bold);
    let em = font.units_per_em().unwrap_or(2048.0);
    PxScale::from(size as f32 * font.height_unscaled() / em)
}

/// Width of a line of text.
pub(super) fn width(text: &str, size: f64, bold: bool) -> f64 {
    f64::from(pens(text, size, bold).1)
}

/// Breaks text into lines no wider than `most`: at spaces, else after punctuation (specs have no
/// spaces), else anywhere. At least one line.
pub(super) fn wrap(text: &str, size: f64, bold: bool, most: f64) -> Vec<String> {
    let fits = |line: &str| width(line.trim_end(), size, bold) <= most;
    let mut lines = vec![String::new()];
    // Not at no-break spaces.
    for word in text.split_inclusive([' ', '\t', '\n']) {
        let pieces = if fits(word) { vec![word] } else { pieces(word) };
        for piece in pieces {
            let line = lines.last_mut().expect("there is a line");
            if fits(&format!("{line}{piece}")) {
                line.push_str(piece);
            } else if fits(piece) {
                lines.push(piece.to_string());
            } else {
                break_anywhere(&mut lines, piece, &fits);
            }
        }
    }
    // A first piece that is too wide leaves the first line empty.
    if lines.len() > 1 && lines[0].is_empty() {
        lines.remove(0);
    }
    lines.iter().map(|line| line.trim_end().to_string()).collect()
}

/// Breaks text into as few lines as [`wrap`] does, but of like widths, for titles and names.
pub(super) fn wrap_evenly(text: &str, size: f64, bold: bool, most: f64) -> Vec<String> {
    let mut best = wrap(text, size, bold, most);
    // Words stay whole that are whole in these.
    let word = text.split(' ').map(|word| width(word, size, bold)).fold(0.0, f64::max);
    let (mut too_narrow, mut wide) = (word.max(most / (best.len() + 1) as f64) - 1.0, most);
    while best.len() > 1 && wide - too_narrow > 2.0 {
        let middle = 0.5 * (too_narrow + wide);
        let lines = wrap(text, size, bold, middle);
        if lines.len() > best.len() || (word <= most && middle < word) {
            too_narrow = middle;
        } else {
            (best, wide) = (lines, middle);
        }
    }
    best
}

fn break_anywhere(lines: &mut Vec<String>, piece: &str, fits: &impl Fn(&str) -> bool) {
    for c in piece.chars() {
        let line = lines.last_mut().expect("there is a line");
        line.push(c);
        if !fits(line) && line.chars().count() > 1 {
            line.pop();
            lines.push(c.to_string());
        }
    }
}

/// Parts of a word that end in punctuation.
fn pieces(word: &str) -> Vec<&str> {
    let mut pieces = Vec::new();
    let (mut start, mut last) = (0, ' ');
    for (at, c) in word.char_indices() {
        // Not within `--flag`.
        let has_begun = word[start..at].contains(char::is_alphanumeric);
        if has_begun && ",:;/=_-|".contains(last) && c.is_alphanumeric() {
            pieces.push(&word[start..at]);
            start = at;
        }
        last = c;
    }
    pieces.push(&word[start..]);
    pieces
}

/// A text as plotters' backends want it, at `factor` times its size.
pub(super) struct Style<'a> {
    pub(super) text: &'a Text,
    pub(super) factor: f64,
}

impl Style<'_> {
    fn em(&self) -> f64 {
        self.text.size * self.factor
    }
}

/// A colour as plotters' backends want it.
pub(super) fn backend_colour(rgb: Colour, alpha: f64) -> BackendColor {
    BackendColor { alpha, rgb: rgb.into() }
}

// plotters has text of its own, but with ab_glyph it leaves out side bearings and rounds every pen
// position, and its bitmaps and SVGs differ in size.
impl BackendTextStyle for Style<'_> {
    type FontError = Infallible;

    fn color(&self) -> BackendColor {
        backend_colour(self.text.colour, 1.0)
    }

    fn size(&self) -> f64 {
        PLOTTERS_SIZE * self.em()
    }

    fn transform(&self) -> FontTransform {
        if self.text.upwards { FontTransform::Rotate270 } else { FontTransform::None }
    }

    fn style(&self) -> FontStyle {
        if self.text.bold { FontStyle::Bold } else { FontStyle::Normal }
    }

    fn anchor(&self) -> Pos {
        let horizontal = match self.text.align {
            HAlign::Left => HPos::Left,
            HAlign::Centre => HPos::Center,
            HAlign::Right => HPos::Right,
        };
        Pos::new(horizontal, VPos::Center)
    }

    fn family(&self) -> FontFamily<'_> {
        FontFamily::Name(FAMILY)
    }

    fn layout_box(&self, text: &str) -> Result<((i32, i32), (i32, i32)), Infallible> {
        let advance = width(text, self.em(), self.text.bold);
        Ok(((0, 0), (advance.round() as i32, 2 * self.em().round() as i32)))
    }

    fn draw<E, D: FnMut(i32, i32, BackendColor) -> Result<(), E>>(
        &self,
        text: &str,
        (left, top): BackendCoord,
        mut draw: D,
    ) -> Result<Result<(), E>, Infallible> {
        let em = self.em();
        // The box of `layout_box` is two ems high: its middle is that of an x on the baseline.
        let baseline = (em.round() + 0.5 * X_HEIGHT * em).round() as f32;
        let font = face(self.text.bold);
        for (id, pen) in pens(text, em, self.text.bold).0 {
            let glyph = id.with_scale_and_position(scale(em, self.text.bold), point(pen, baseline));
            let Some(outline) = font.outline_glyph(glyph) else { continue };
            let corner = outline.px_bounds().min;
            let (x0, y0) = (left + corner.x as i32, top + corner.y as i32);
            let mut result = Ok(());
            outline.draw(|x, y, coverage| {
                if result.is_ok() && coverage > 0.0 {
                    let colour = backend_colour(self.text.colour, f64::from(coverage.min(1.0)));
                    result = draw(x0 + x as i32, y0 + y as i32, colour);
                }
            });
            if result.is_err() {
                return Ok(result);
            }
        }
        Ok(Ok(()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_fit_and_lose_nothing() {
        let text =
            "sato bench --backend bvh2:order=rtsah-approx-clamped,trace=packet xxxxxxxxxxxxxxxxxx";
        for most in [0.0, 5.0, 60.0, 200.0, 1e4] {
            for lines in [wrap(text, 13.0, false, most), wrap_evenly(text, 13.0, false, most)] {
                let fits =
                    |line: &String| line.chars().count() == 1 || width(line, 13.0, false) <= most;
                assert!(lines.iter().all(fits), "{most}: {lines:?}");
                let bare = |text: &str| text.replace(' ', "");
                assert_eq!(bare(&lines.concat()), bare(text));
            }
        }
        assert_eq!(wrap("", 13.0, false, 10.0), [""]);
    }

    #[test]
    fn breaks_are_where_a_reader_expects_them() {
        let even = |text| wrap_evenly(text, 13.0, false, 115.0);
        assert_eq!(even("carnival (446 k)"), ["carnival (446 k)"]);
        assert_eq!(even("shadow-overlap (2 M)"), ["shadow-overlap", "(2 M)"]);
        assert_eq!(even("no\u{a0}break"), ["no\u{a0}break"]);
        assert_eq!(pieces("--a-b=c,d"), ["--a-", "b=", "c,", "d"]);
    }

    #[test]
    fn widths_are_those_of_the_font() {
        // 0.636 ems each.
        assert!((width("0000", 100.0, false) - 254.5).abs() < 0.5);
        assert!(width("0", 13.0, true) > width("0", 13.0, false));
        assert_eq!(width("", 13.0, false), 0.0);
    }
}
