//! Turns a frame's bytes into sixteen-bit numbers.

use super::{
    codecs,
    fragments::Fragments,
    image::{Format, Image},
    slice::Slice,
};
use crate::volume::{asset::Rescale, error::VolumeError};

/// The pixels of several frames, read once.
pub(super) enum Shared {
    Native(Vec<u8>),
    Compressed(Fragments),
}

impl Shared {
    /// Reads the pixels of an image, if frames cannot be read one by one.
    pub fn read(image: &Image) -> Result<Self, VolumeError> {
        match image.pixels.length {
            None => Ok(Self::Compressed(Fragments::read(image)?)),
            Some(length) => {
                let mut bytes = image.source.range(image.pixels.start, length)?;
                if image.has_swapped_bytes() {
                    bytes.as_chunks_mut::<2>().0.iter_mut().for_each(|pair| pair.reverse());
                }
                Ok(Self::Native(bytes))
            }
        }
    }

    /// Whether the frames of an image share their reading: compressed frames follow each other, and so do all bytes of
    /// a file in an archive. Pairs of swapped bytes may belong to two frames.
    pub fn is_useful(image: &Image) -> bool {
        let one_by_one = image.pixels.length.is_some() && !image.source.is_deflated();
        image.frames > 1 && !one_by_one || image.has_swapped_bytes()
    }

    fn words(&self, image: &Image, frame: u32) -> Result<Vec<u32>, VolumeError> {
        match self {
            Self::Compressed(fragments) => codecs::decode(image, &fragments.frame(frame)),
            Self::Native(bytes) => {
                let length = image.frame_bytes() as usize;
                let frame = bytes.chunks_exact(length).nth(frame as usize);
                Ok(words(image, frame.ok_or_else(|| cut_off(image, 0))?))
            }
        }
    }
}

fn cut_off(image: &Image, found: usize) -> VolumeError {
    VolumeError::Truncated { expected_bytes: image.frame_bytes(), found_bytes: found as u64 }
}

/// Numbers of a slice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Decoded {
    /// Lowest and highest number, without padding; `None` if all is padding.
    pub range: Option<[u16; 2]>,
    /// The number that padding has, and how many pixels have it.
    pub padding: Option<(u16, u64)>,
    /// Conversion of the numbers to file units.
    pub rescale: Rescale,
}

/// Decodes a slice into `to`, which has room for its pixels.
pub(super) fn decode(slice: &Slice, shared: Option<&Shared>, to: &mut [u16]) -> Result<Decoded, VolumeError> {
    let image = &*slice.image;
    let words = match shared {
        Some(shared) => shared.words(image, slice.frame)?,
        None if image.pixels.length.is_none() => {
            codecs::decode(image, &Fragments::read(image)?.frame(slice.frame))?
        }
        None => {
            let length = image.frame_bytes();
            let start = image.pixels.start + length * u64::from(slice.frame);
            let bytes = image.source.range(start, length)?;
            if bytes.len() as u64 != length {
                return Err(cut_off(image, bytes.len()));
            }
            words(image, &bytes)
        }
    };
    Ok(if image.format.bits_allocated == 32 {
        wide(image.format, slice.rescale, &words, to)
    } else {
        narrow(image.format, slice.rescale, &words, to)
    })
}

/// The pixels' words of an uncompressed frame.
fn words(image: &Image, bytes: &[u8]) -> Vec<u32> {
    let (twos, fours) = (bytes.as_chunks::<2>().0, bytes.as_chunks::<4>().0);
    match (image.format.bits_allocated, image.big_endian) {
        (8, _) => bytes.iter().copied().map(u32::from).collect(),
        (16, false) => twos.iter().map(|&two| u16::from_le_bytes(two).into()).collect(),
        (16, true) => twos.iter().map(|&two| u16::from_be_bytes(two).into()).collect(),
        (_, false) => fours.iter().map(|&four| u32::from_le_bytes(four)).collect(),
        (_, true) => fours.iter().map(|&four| u32::from_be_bytes(four)).collect(),
    }
}

impl Format {
    /// The number in a word's bits, of which the highest may be its sign.
    fn number(self, word: u32) -> i64 {
        let low = self.high_bit + 1 - self.bits_stored;
        extend(u64::from(word >> low), self.bits_stored, self.signed)
    }

    /// Whether a word marks a pixel without a value. A mark may use upper bits that numbers do not.
    fn is_padding(self, word: u32) -> bool {
        self.padding.is_some_and(|[low, high]| {
            let is_lowest = self.high_bit + 1 == self.bits_stored;
            let whole = extend(word.into(), self.bits_allocated, self.signed);
            (low..=high).contains(&self.number(word)) || is_lowest && (low..=high).contains(&whole)
        })
    }
}

/// The number in the lowest bits.
fn extend(word: u64, bits: u32, signed: bool) -> i64 {
    let upper = 64 - bits;
    if signed { (word << upper) as i64 >> upper } else { (word << upper >> upper) as i64 }
}

/// Numbers of up to sixteen bits are kept as they are, with an offset for signed ones.
fn narrow(format: Format, rescale: Rescale, words: &[u32], to: &mut [u16]) -> Decoded {
    let offset = if format.signed { 1i64 << (format.bits_stored - 1) } else { 0 };
    // A number that no pixel has: above all others, or within the padding.
    let mark = match format.padding {
        Some([low, _]) if format.bits_stored == 16 => (low + offset).clamp(0, u16::MAX.into()) as u16,
        _ => u16::MAX,
    };
    let (mut low, mut high, mut padding) = (u16::MAX, 0, 0);
    for (to, &word) in to.iter_mut().zip(words) {
        if format.is_padding(word) {
            *to = mark;
            padding += 1;
        } else {
            *to = (format.number(word) + offset) as u16;
            (low, high) = (low.min(*to), high.max(*to));
        }
    }
    Decoded {
        range: (low <= high).then_some([low, high]),
        padding: (padding > 0).then_some((mark, padding)),
        rescale: Rescale { intercept: rescale.intercept - rescale.slope * offset as f64, ..rescale },
    }
}

/// Numbers of more bits are fitted into sixteen, slice by slice: exactly if their range allows it, else in 65536 steps.
fn wide(format: Format, rescale: Rescale, words: &[u32], to: &mut [u16]) -> Decoded {
    let numbers = || words.iter().map(|&word| (!format.is_padding(word)).then(|| format.number(word)));
    let range = numbers().flatten().fold(None, |range: Option<[i64; 2]>, number| {
        let [low, high] = range.unwrap_or([number; 2]);
        Some([low.min(number), high.max(number)])
    });
    let [low, high] = range.unwrap_or_default();
    // The highest number is left to padding.
    let step = if high - low < 65_535 { 1.0 } else { (high - low) as f64 / 65_534.0 };
    let mut padding = 0;
    for (to, number) in to.iter_mut().zip(numbers()) {
        padding += u64::from(number.is_none());
        *to = number.map_or(u16::MAX, |number| ((number - low) as f64 / step).round() as u16);
    }
    Decoded {
        range: range.map(|_| [0, ((high - low) as f64 / step).round() as u16]),
        padding: (padding > 0).then_some((u16::MAX, padding)),
        rescale: Rescale {
            slope: rescale.slope * step,
            intercept: rescale.slope * low as f64 + rescale.intercept,
        },
    }
}
