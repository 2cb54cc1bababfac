//! OpenEXR files: all layers in one part, as `layer.channel`.

use crate::Result;
use crate::output::write_atomically;
use crate::render::{Channel, Film, Layer};
use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image};
use exr::meta::attribute::{AttributeValue, Text};
use exr::prelude::{Layer as ExrLayer, LayerAttributes, WritableImage};
use std::io::{self, Cursor, Write};
use std::path::Path;

/// Writes all layers of `film` and `metadata` (names of at most 255 bytes and values, which become
/// string attributes) to one OpenEXR file: one part, 32-bit floats, ZIP compression, channels named
/// `layer.channel` with those of the first layer without a layer name, which is what viewers and
/// tools in the field agree on. Equal films make equal bytes.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io) naming the file.
pub fn write_exr(path: &Path, film: &Film, metadata: &[(String, String)]) -> Result<()> {
    write_atomically(path, |out| out.write_all(&encode(film, metadata).map_err(io::Error::other)?))
}

fn encode(film: &Film, metadata: &[(String, String)]) -> exr::error::Result<Vec<u8>> {
    let channel = |layer: &Layer, channel: &Channel| {
        let name = match layer.name.as_str() {
            "" => channel.name.to_owned(),
            layer => format!("{layer}.{}", channel.name),
        };
        AnyChannel::new(text(&name), FlatSamples::F32(channel.values.clone()))
    };
    let channels = film.layers().iter().flat_map(|l| l.channels.iter().map(|c| channel(l, c)));
    let metadata = metadata.iter();
    let attributes = LayerAttributes {
        software_name: Some(text(concat!("sato ", env!("CARGO_PKG_VERSION")))),
        other: metadata.map(|(k, v)| (text(k), AttributeValue::Text(text(v)))).collect(),
        ..LayerAttributes::default()
    };
    let size = film.size().map(|n| n as usize);
    let layer = ExrLayer::new(
        (size[0], size[1]),
        attributes,
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels.collect()),
    );
    let mut bytes = Vec::new();
    Image::from_layer(layer).write().to_buffered(Cursor::new(&mut bytes))?;
    sort_attributes(&mut bytes);
    Ok(bytes)
}

/// As UTF-8: the crate's own conversion knows Latin-1 only and panics on the rest.
fn text(string: &str) -> Text {
    Text::from_slice_unchecked(string.as_bytes())
}

/// Sorts the attributes of a single-part file by name. The crate keeps ours in a hash map, whose
/// order is another in every run.
///
/// A header is attributes (name, 0, type, 0, length as `i32`, value) up to an empty name, after
/// eight bytes of magic number and version. No length changes, so no offset in the file does.
fn sort_attributes(file: &mut [u8]) {
    const START: usize = 8;
    let mut attributes: Vec<Vec<u8>> = Vec::new();
    let mut at = START;
    let string_end = |from: usize| from + file[from..].iter().take_while(|&&b| b != 0).count() + 1;
    while file[at] != 0 {
        let length_at = string_end(string_end(at));
        let length = u32::from_le_bytes(std::array::from_fn(|i| file[length_at + i]));
        let end = length_at + 4 + length as usize;
        attributes.push(file[at..end].to_vec());
        at = end;
    }
    attributes.sort();
    file[START..at].copy_from_slice(&attributes.concat());
}
