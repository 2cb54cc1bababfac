//! Zstandard frames.

use ruzstd::decoding::StreamingDecoder;
use ruzstd::decoding::errors::{FrameDecoderError, ReadFrameHeaderError};
use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use std::io::Read;

/// What is in `data`: one or more frames, with lengths and checksums verified.
pub(super) fn decompress(mut data: &[u8]) -> Result<Vec<u8>, String> {
    use FrameDecoderError::ReadFrameHeaderError as Header;
    let mut out = Vec::new();
    loop {
        match StreamingDecoder::new(&mut data) {
            Ok(mut frame) => {
                let start = out.len();
                frame.read_to_end(&mut out).map_err(|e| e.to_string())?;
                let decoder = frame.decoder;
                // The decoder reads both and leaves it to us to compare.
                let length = decoder.content_size();
                if length != 0 && length != (out.len() - start) as u64 {
                    return Err(format!("{} bytes, not {length}", out.len() - start));
                }
                let stored = decoder.get_checksum_from_data();
                if stored.is_some() && stored != decoder.get_calculated_checksum() {
                    return Err("the checksum does not match".into());
                }
            }
            Err(Header(ReadFrameHeaderError::SkipFrame { length, .. })) => {
                data = data.get(length as usize..).ok_or("truncated skippable frame")?;
            }
            Err(Header(ReadFrameHeaderError::BadMagicNumber(_))) => {
                return Err("not Zstandard data".into());
            }
            Err(e) => return Err(e.to_string()),
        }
        if data.is_empty() {
            return Ok(out);
        }
    }
}

/// One frame with `data`.
pub(super) fn compress(data: &[u8]) -> Vec<u8> {
    compress_to_vec(data, CompressionLevel::Fastest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_follow_one_another() {
        let skippable = [0x50, 0x2a, 0x4d, 0x18, 2, 0, 0, 0, 9, 9];
        let data = [compress(b"one "), skippable.to_vec(), compress(b"two")].concat();
        assert_eq!(decompress(&data).unwrap(), b"one two");
        assert!(decompress(&data[..data.len() - 1]).is_err());
        assert!(decompress(&[&data[..], b"rubbish"].concat()).is_err());
        assert!(decompress(&skippable[..9]).is_err());
        assert!(decompress(b"").is_err());
    }

    #[test]
    fn a_flipped_bit_shows() {
        let mut data = compress(&[b'x'; 1000]);
        let last = data.len() - 1;
        data[last] ^= 1;
        assert!(decompress(&data).unwrap_err().contains("checksum"));
    }
}
