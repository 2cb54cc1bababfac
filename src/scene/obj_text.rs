//! The text of an OBJ file as tobj shall see it, and where it is at fault.
//!
//! tobj 4.0.5 reads what sato needs, with traps that [`PositionsOnly`] keeps away from it: huge
//! texture and normal indices overflow (a panic in debug builds), `l` elements become triangles,
//! vertices are repeated for each group and each texture index, colours on some vertices only are
//! an error, a byte-order mark hides the first line, comments after values, continued lines, lone
//! carriage returns and comments that are not UTF-8 are not understood. Its errors name no line:
//! [`find_fault`] finds the line afterwards, so that a good file does not pay for it.

use super::mesh_builder::MAX_COORDINATE;
use std::borrow::Cow;
use std::io::{self, BufRead, Read};

/// Bytes of filtered text made at a time.
const CHUNK_BYTES: usize = 1 << 16;

/// Lines with their one-based numbers; a backslash at the end joins the next line on.
struct Lines<'a> {
    rest: &'a [u8],
    next_number: usize,
}

impl<'a> Lines<'a> {
    fn new(text: &'a [u8]) -> Self {
        Self { rest: text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text), next_number: 1 }
    }

    fn physical_line(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        self.next_number += 1;
        let end = self.rest.iter().position(|&b| b == b'\n' || b == b'\r');
        let Some(end) = end else { return Some(std::mem::take(&mut self.rest)) };
        let (line, rest) = self.rest.split_at(end);
        self.rest = rest.strip_prefix(b"\r\n").unwrap_or(&rest[1..]);
        Some(line)
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, Cow<'a, [u8]>);

    fn next(&mut self) -> Option<Self::Item> {
        let number = self.next_number;
        let mut line = Cow::Borrowed(self.physical_line()?);
        while let Some(start) = line.strip_suffix(b"\\") {
            let mut joined = start.to_vec();
            joined.push(b' ');
            joined.extend_from_slice(self.physical_line().unwrap_or_default());
            line = Cow::Owned(joined);
        }
        Some((number, line))
    }
}

/// The lines that matter here.
enum Element<'a> {
    Vertex(&'a [u8]),
    Face(&'a [u8]),
    Group,
    Other,
}

/// What `line` is, with its arguments but without any comment.
fn element(line: &[u8]) -> Element<'_> {
    let line = line.trim_ascii_start();
    let make = match line {
        [b'v', b' ' | b'\t', ..] | b"v" => Element::Vertex,
        [b'f', b' ' | b'\t', ..] | b"f" => Element::Face,
        [b'g' | b'o', b' ' | b'\t', ..] | b"g" | b"o" => return Element::Group,
        _ => return Element::Other,
    };
    make(line[1..].split(|&b| b == b'#').next().unwrap_or_default())
}

fn words(arguments: &[u8]) -> impl Iterator<Item = &[u8]> + Clone {
    arguments.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// The part of a face's word that is the vertex index.
fn vertex_part(word: &[u8]) -> &[u8] {
    match word.split(|&b| b == b'/').next() {
        Some(index) if !index.is_empty() => index,
        _ => word,
    }
}

/// Streams the `v` and `f` lines of an OBJ file with vertex positions and vertex indices only, and
/// counts what goes by.
pub(super) struct PositionsOnly<'a> {
    lines: Lines<'a>,
    chunk: Vec<u8>,
    read: usize,
    /// Vertices so far, used or not.
    pub(super) vertices: usize,
    /// Triangles so far, of polygons split into fans.
    pub(super) triangles: usize,
    /// How many triangles came before each `g` or `o` line.
    pub(super) groups: Vec<usize>,
}

impl<'a> PositionsOnly<'a> {
    pub(super) fn new(text: &'a [u8]) -> Self {
        Self {
            lines: Lines::new(text),
            chunk: Vec::new(),
            read: 0,
            vertices: 0,
            triangles: 0,
            groups: Vec::new(),
        }
    }

    fn push(&mut self, line: &[u8]) {
        match element(line) {
            Element::Vertex(arguments) => {
                self.chunk.push(b'v');
                self.vertices += 1;
                // Six values and more are a position and a colour.
                let count = words(arguments).take(6).count();
                for word in words(arguments).take(if count == 6 { 3 } else { count }) {
                    self.chunk.push(b' ');
                    self.chunk.extend_from_slice(word);
                }
            }
            Element::Face(arguments) => {
                self.chunk.push(b'f');
                // tobj makes triangles of points and lines; it refuses a face without vertices.
                let count = words(arguments).count();
                if count > 2 {
                    self.triangles += count - 2;
                    for word in words(arguments) {
                        self.chunk.push(b' ');
                        self.chunk.extend_from_slice(vertex_part(word));
                    }
                }
            }
            Element::Group => {
                self.groups.push(self.triangles);
                return;
            }
            Element::Other => return,
        }
        self.chunk.push(b'\n');
    }
}

impl BufRead for PositionsOnly<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.read == self.chunk.len() {
            self.chunk.clear();
            self.read = 0;
            while self.chunk.len() < CHUNK_BYTES {
                let Some((_, line)) = self.lines.next() else { break };
                self.push(&line);
            }
        }
        Ok(&self.chunk[self.read..])
    }

    fn consume(&mut self, amount: usize) {
        self.read += amount;
    }
}

impl Read for PositionsOnly<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let amount = self.fill_buf()?.read(buffer)?;
        self.consume(amount);
        Ok(amount)
    }
}

/// The first line that makes the file unusable, and why.
pub(super) fn find_fault(text: &[u8]) -> Option<(usize, String)> {
    let is_vertex = |line: &[u8]| matches!(element(line), Element::Vertex(_));
    let vertex_count = Lines::new(text).filter(|(_, line)| is_vertex(line)).count();
    let mut seen = 0;
    for (number, line) in Lines::new(text) {
        let checked = match element(&line) {
            Element::Vertex(arguments) => {
                seen += 1;
                check_vertex(arguments)
            }
            Element::Face(arguments) => check_face(arguments, seen, vertex_count),
            Element::Group | Element::Other => Ok(()),
        };
        if let Err(message) = checked {
            return Some((number, message));
        }
    }
    None
}

fn check_vertex(arguments: &[u8]) -> Result<(), String> {
    let count = words(arguments).count();
    if count < 3 || count == 5 {
        return Err(format!("vertex has {count} numbers, not 3 (or 4, or 6 with a colour)"));
    }
    let mut values = [0.0, 0.0, 0.0, 1.0f32];
    for (value, word) in
        values.iter_mut().zip(words(arguments).take(if count == 4 { 4 } else { 3 }))
    {
        *value = parse(word).ok_or_else(|| format!("not a number: {}", quoted(word)))?;
    }
    let [x, y, z, w] = values;
    if w == 0.0 {
        return Err("vertex has the weight 0".into());
    }
    match [x / w, y / w, z / w].iter().find(|x| x.is_finite() && x.abs() > MAX_COORDINATE) {
        Some(x) => Err(format!("coordinate {x:e} is beyond {MAX_COORDINATE:e}")),
        None => Ok(()),
    }
}

fn check_face(arguments: &[u8], seen: usize, vertex_count: usize) -> Result<(), String> {
    let count = words(arguments).count();
    if count < 3 {
        return Err(format!("face has fewer than 3 vertices: {count}"));
    }
    for word in words(arguments) {
        let index: isize = parse(vertex_part(word))
            .ok_or_else(|| format!("not a vertex index: {}", quoted(word)))?;
        if index == 0 {
            return Err("vertex index 0: indices start at 1".into());
        }
        let available = if index < 0 { seen } else { vertex_count };
        if index.unsigned_abs() > available {
            let among = if index < 0 { "before this line" } else { "in the file" };
            return Err(format!(
                "vertex index {index} is out of range: {available} vertices {among}"
            ));
        }
    }
    Ok(())
}

fn parse<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A word as it can stand in a message: short, printable, on one line.
fn quoted(word: &[u8]) -> String {
    let shown = String::from_utf8_lossy(&word[..word.len().min(40)]);
    let more = if word.len() > 40 { "..." } else { "" };
    format!("`{}{more}`", shown.escape_debug())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filtered(text: &str) -> String {
        let mut out = String::new();
        PositionsOnly::new(text.as_bytes()).read_to_string(&mut out).unwrap();
        out
    }

    #[test]
    fn keeps_positions_and_vertex_indices_only() {
        let text = "\u{feff}v 0 0 0 1 0 0 # red\r\nvt 0 0\rvn 0 0 1\n  v 1 0\\\n 0\ng a\n\
            f 1/9/9 2//7 3\t-1/2\nl 1 2 3\nf 1 2\np 1\nvp 1 2\nv";
        assert_eq!(filtered(text), "v 0 0 0\nv 1 0 0\nf 1 2 3 -1\nf\nv\n");
    }

    #[test]
    fn counts_vertices_triangles_and_groups() {
        let text = "o a\nv 0 0 0\nv 0 0 0\nf 1 2 1 2 1\ng\ng b # c\nf 1 1 1\ngroup\nf 1 2\n";
        let mut reader = PositionsOnly::new(text.as_bytes());
        io::copy(&mut reader, &mut io::sink()).unwrap();
        assert_eq!((reader.vertices, reader.triangles), (2, 4));
        assert_eq!(reader.groups, [0, 3, 3]);
    }

    #[test]
    fn lines_count_from_one_whatever_ends_them() {
        let numbers = |text: &'static str| -> Vec<_> {
            Lines::new(text.as_bytes()).map(|(n, _)| n).collect()
        };
        assert_eq!(numbers("a\nb\r\nc\rd"), [1, 2, 3, 4]);
        assert_eq!(numbers("a\\\nb\nc\\"), [1, 3]);
        assert_eq!(numbers("\n\n"), [1, 2]);
    }
}
