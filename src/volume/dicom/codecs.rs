//! Decodes compressed frames. A codec sees a frame only if its own head agrees with the file's.

use std::panic::{AssertUnwindSafe, catch_unwind};

use super::{image::Image, rle, syntax::Syntax};
use crate::volume::error::VolumeError;

/// The pixels' words of a frame, as wide as `BitsAllocated`.
///
/// A codec's panic is an error, where panics unwind; a page in a browser ends with it.
pub(super) fn decode(image: &Image, frame: &[u8]) -> Result<Vec<u32>, VolumeError> {
    let decoded = catch_unwind(AssertUnwindSafe(|| match image.syntax {
        Syntax::Rle => rle::decode(frame, image.frame_pixels() as usize, image.format.bytes() as usize),
        Syntax::Jpeg => jpeg(image, frame),
        Syntax::JpegLs => jpeg_ls(image, frame),
        Syntax::Jpeg2000 => jpeg_2000(image, frame),
        Syntax::Native => Err(damaged(image, "not compressed")),
    }));
    let words = decoded.unwrap_or_else(|_| Err(damaged(image, "the decoder panicked")))?;
    if words.len() as u64 != image.frame_pixels() {
        return Err(damaged(image, "the decoder returned another number of pixels"));
    }
    Ok(words)
}

fn damaged(image: &Image, reason: impl std::fmt::Display) -> VolumeError {
    VolumeError::Damaged { reason: format!("{:?}: {reason}", image.syntax) }
}

/// A frame's size and number format, by its own head.
#[derive(Debug)]
struct Head {
    columns: u32,
    rows: u32,
    bits: u32,
    components: u32,
}

impl Head {
    /// Checks the head against the file's fields.
    fn check(&self, image: &Image) -> Result<(), VolumeError> {
        let Self { columns, rows, bits, components } = *self;
        if [columns, rows] != [image.columns, image.rows] {
            let [width, height] = [image.columns, image.rows];
            return Err(damaged(image, format!("{columns}x{rows} pixels, and {width}x{height} by the file")));
        }
        if components != 1 || bits > image.format.bits_allocated {
            let allocated = image.format.bits_allocated;
            let reason = format!("{components} values of {bits} bits, and one of {allocated} by the file");
            return Err(damaged(image, reason));
        }
        Ok(())
    }
}

/// The frame header of JPEG and JPEG-LS, whatever its kind.
fn jpeg_head(frame: &[u8]) -> Option<Head> {
    let mut at = 2;
    if frame.get(..2)? != [0xff, 0xd8] {
        return None;
    }
    loop {
        let &[0xff, marker, a, b] = frame.get(at..)?.first_chunk()? else {
            // Fill bytes may precede a marker.
            if frame.get(at) == Some(&0xff) && frame.get(at + 1) == Some(&0xff) {
                at += 1;
                continue;
            }
            return None;
        };
        if marker == 0xff {
            at += 1;
            continue;
        }
        let is_frame = matches!(marker, 0xc0..=0xcf | 0xf7) && !matches!(marker, 0xc4 | 0xc8 | 0xcc);
        if is_frame {
            let &[bits, h0, h1, w0, w1, components] = frame.get(at + 4..)?.first_chunk()?;
            return Some(Head {
                columns: u16::from_be_bytes([w0, w1]).into(),
                rows: u16::from_be_bytes([h0, h1]).into(),
                bits: bits.into(),
                components: components.into(),
            });
        }
        at += 2 + usize::from(u16::from_be_bytes([a, b]));
    }
}

fn jpeg(image: &Image, frame: &[u8]) -> Result<Vec<u32>, VolumeError> {
    jpeg_head(frame).ok_or_else(|| damaged(image, "no frame header"))?.check(image)?;
    let mut decoder = jpeg_decoder::Decoder::new(frame);
    // The decoder's bytes are two a pixel at most.
    decoder.set_max_decoding_buffer_size(2 * image.frame_pixels() as usize);
    let bytes = decoder.decode().map_err(|error| damaged(image, error))?;
    match decoder.info().map(|info| info.pixel_format) {
        Some(jpeg_decoder::PixelFormat::L8) => Ok(bytes.into_iter().map(u32::from).collect()),
        Some(jpeg_decoder::PixelFormat::L16) => {
            Ok(bytes.as_chunks().0.iter().map(|&two| u16::from_ne_bytes(two).into()).collect())
        }
        _ => Err(damaged(image, "a picture in colour")),
    }
}

fn jpeg_ls(image: &Image, frame: &[u8]) -> Result<Vec<u32>, VolumeError> {
    jpeg_head(frame).ok_or_else(|| damaged(image, "no frame header"))?.check(image)?;
    let (words, ..) =
        jpegls::decode(frame, image.columns, image.rows).map_err(|error| damaged(image, error))?;
    Ok(words.into_iter().map(u32::from).collect())
}

/// The size marker of a JPEG 2000 codestream.
fn siz(frame: &[u8]) -> Option<Head> {
    // Some programs write a whole JP2 file. Its codestream begins with these two markers.
    let start = [0xff, 0x4f, 0xff, 0x51];
    let at = frame.windows(4).take(1 << 12).position(|four| four == start)?;
    let marker: &[u8; 41] = frame.get(at + 4..)?.first_chunk()?;
    let number = |at: usize| u32::from_be_bytes([marker[at], marker[at + 1], marker[at + 2], marker[at + 3]]);
    let [right, bottom, left, top, tile_width, tile_height] = [4, 8, 12, 16, 20, 24].map(number);
    let columns = right.checked_sub(left)?;
    let rows = bottom.checked_sub(top)?;
    // Thousands of tiles take more memory than their pixels.
    let tiles = u64::from(right.div_ceil(tile_width.max(1))) * u64::from(bottom.div_ceil(tile_height.max(1)));
    let most = 16 + u64::from(columns) * u64::from(rows) / 1024;
    let (components, depth) = (u16::from_be_bytes([marker[36], marker[37]]), marker[38]);
    // The upper bit of the depth says that values are signed.
    let head = Head { columns, rows, bits: u32::from(depth & 0x7f) + 1, components: components.into() };
    (tiles <= most && [marker[39], marker[40]] == [1, 1]).then_some(head)
}

fn jpeg_2000(image: &Image, frame: &[u8]) -> Result<Vec<u32>, VolumeError> {
    siz(frame).ok_or_else(|| damaged(image, "no usable size marker"))?.check(image)?;
    let strict = jpeg2k::DecodeParameters::new().strict(true);
    let decoded = jpeg2k::Image::from_bytes_with(frame, strict).map_err(|error| damaged(image, error))?;
    let [component] = decoded.components() else { return Err(damaged(image, "a picture in colour")) };
    if [component.width(), component.height()] != [image.columns, image.rows] {
        return Err(damaged(image, "another size than its head's"));
    }
    Ok(component.data().iter().map(|&value| value as u32).collect())
}
