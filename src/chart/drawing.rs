//! What a chart consists of once it is laid out: shapes and texts at places on a page, in pixels from
//! the upper left. Layout makes it, `paint` turns it into files.

use super::palette::INK;

/// Red, green and blue.
pub(super) type Colour = [u8; 3];
/// A place: right and down.
pub(super) type Place = [f64; 2];

/// The side of a text that lies at its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum HAlign {
    Left,
    Centre,
    Right,
}

/// A line of text, centred vertically on its place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Text {
    pub(super) at: Place,
    pub(super) text: String,
    pub(super) size: f64,
    pub(super) bold: bool,
    pub(super) align: HAlign,
    /// Reads from the bottom to the top.
    pub(super) upwards: bool,
    pub(super) colour: Colour,
}

impl Text {
    /// Ordinary text; clean of what XML cannot hold.
    pub(super) fn new(at: Place, text: &str, size: f64, align: HAlign) -> Self {
        let holds = |c: char| !c.is_control() && !('\u{FFFE}'..='\u{FFFF}').contains(&c);
        let text = text.chars().map(|c| if holds(c) { c } else { ' ' }).collect();
        Self { at, text, size, bold: false, align, upwards: false, colour: INK }
    }

    pub(super) fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    pub(super) fn upwards(self) -> Self {
        Self { upwards: true, ..self }
    }

    pub(super) fn colour(self, colour: Colour) -> Self {
        Self { colour, ..self }
    }
}

/// A shape or text.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Item {
    /// A filled rectangle, by its upper left and lower right corner.
    Rect { from: Place, to: Place, colour: Colour },
    /// A straight line of a width.
    Line { from: Place, to: Place, width: f64, colour: Colour },
    /// A filled convex polygon.
    Polygon { points: Vec<Place>, colour: Colour },
    /// A disk, from clear, 0, to opaque, 1.
    Disk { centre: Place, radius: f64, colour: Colour, alpha: f64 },
    /// A line of text.
    Text(Text),
}

/// Items in the order in which they are drawn, and the room that they take.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Drawing {
    pub(super) size: Place,
    pub(super) items: Vec<Item>,
}

impl Drawing {
    pub(super) fn new(size: Place) -> Self {
        Self { size, items: Vec::new() }
    }

    pub(super) fn text(&mut self, text: Text) {
        if !text.text.trim().is_empty() {
            self.items.push(Item::Text(text));
        }
    }

    /// Lines of text one below the other, centred vertically on `at`.
    pub(super) fn lines(&mut self, at: Place, lines: &[String], size: f64, align: HAlign) {
        let step = line_height(size);
        let top = at[1] - 0.5 * step * (lines.len() as f64 - 1.0);
        for (row, line) in lines.iter().enumerate() {
            self.text(Text::new([at[0], top + step * row as f64], line, size, align));
        }
    }

    pub(super) fn rect(&mut self, from: Place, to: Place, colour: Colour) {
        self.items.push(Item::Rect { from, to, colour });
    }

    pub(super) fn line(&mut self, from: Place, to: Place, width: f64, colour: Colour) {
        self.items.push(Item::Line { from, to, width, colour });
    }

    pub(super) fn polygon(&mut self, points: Vec<Place>, colour: Colour) {
        self.items.push(Item::Polygon { points, colour });
    }

    pub(super) fn disk(&mut self, centre: Place, radius: f64, colour: Colour, alpha: f64) {
        self.items.push(Item::Disk { centre, radius, colour, alpha });
    }

    /// A horizontal line on whole pixels, so that it is sharp.
    pub(super) fn horizontal(&mut self, [left, right]: [f64; 2], y: f64, colour: Colour) {
        let y = y.floor();
        self.rect([left.floor(), y], [right.floor() + 1.0, y + 1.0], colour);
    }

    /// A vertical line on whole pixels.
    pub(super) fn vertical(&mut self, x: f64, [top, bottom]: [f64; 2], colour: Colour) {
        let x = x.floor();
        self.rect([x, top.floor()], [x + 1.0, bottom.floor() + 1.0], colour);
    }

    /// A line of dashes.
    pub(super) fn dashes(&mut self, from: Place, to: Place, width: f64, colour: Colour) {
        const DASH: f64 = 6.0;
        let delta = [to[0] - from[0], to[1] - from[1]];
        let length = delta[0].hypot(delta[1]);
        let at = |distance: f64| {
            let part = (distance / length).min(1.0);
            [from[0] + part * delta[0], from[1] + part * delta[1]]
        };
        let mut start = 0.0;
        while start < length {
            self.line(at(start), at(start + DASH), width, colour);
            start += DASH + 4.0;
        }
    }

    /// Puts another drawing on this one, its upper left corner at `place`.
    pub(super) fn place(&mut self, other: Self, [right, down]: Place) {
        let moved = |[x, y]: Place| [x + right, y + down];
        self.items.extend(other.items.into_iter().map(|item| match item {
            Item::Rect { from, to, colour } => {
                Item::Rect { from: moved(from), to: moved(to), colour }
            }
            Item::Line { from, to, width, colour } => {
                Item::Line { from: moved(from), to: moved(to), width, colour }
            }
            Item::Polygon { points, colour } => {
                Item::Polygon { points: points.into_iter().map(moved).collect(), colour }
            }
            Item::Disk { centre, radius, colour, alpha } => {
                Item::Disk { centre: moved(centre), radius, colour, alpha }
            }
            Item::Text(text) => Item::Text(Text { at: moved(text.at), ..text }),
        }));
    }
}

/// From one line of text to the next.
pub(super) fn line_height(size: f64) -> f64 {
    (1.3 * size).round()
}
