//! Compressed frames, which lie in the file as a list of fragments.

use std::{borrow::Cow, ops::Range};

use super::image::Image;
use crate::volume::error::VolumeError;

/// The compressed bytes of all frames of an image.
pub(super) struct Fragments {
    bytes: Vec<u8>,
    /// Fragments of each frame.
    frames: Vec<Vec<Range<usize>>>,
}

impl Fragments {
    pub fn read(image: &Image) -> Result<Self, VolumeError> {
        let bytes = image.source.range(image.pixels.start, u64::MAX)?;
        let (table, fragments) = items(&bytes)?;
        let frames = by_frame(&table, fragments, image.frames as usize)?;
        Ok(Self { bytes, frames })
    }

    /// The bytes of a frame.
    pub fn frame(&self, index: u32) -> Cow<'_, [u8]> {
        let fragments = self.frames.get(index as usize).map_or(&[][..], |fragments| fragments);
        match fragments {
            [one] => self.bytes[one.clone()].into(),
            _ => fragments.iter().flat_map(|range| &self.bytes[range.clone()]).copied().collect(),
        }
    }
}

/// A fragment, and the offset of its head.
struct Fragment {
    offset: usize,
    bytes: Range<usize>,
}

/// The table of offsets, which may be empty, and the fragments after it.
fn items(bytes: &[u8]) -> Result<(Vec<usize>, Vec<Fragment>), VolumeError> {
    let damaged = |reason: &str| VolumeError::Damaged { reason: reason.into() };
    let mut at = 0;
    let mut fragments = Vec::new();
    // Fragments are little endian in every syntax. A list without its end is cut off, unless all frames are there.
    while let Some(&[g0, g1, e0, e1, a, b, c, d]) = bytes.get(at..).and_then(|rest| rest.first_chunk()) {
        let length = u32::from_le_bytes([a, b, c, d]) as usize;
        match [g0, g1, e0, e1] {
            [0xfe, 0xff, 0x00, 0xe0] => {
                let start = at + 8;
                let end = start.checked_add(length).filter(|&end| end <= bytes.len());
                let end = end.ok_or(VolumeError::Truncated {
                    expected_bytes: (start as u64).saturating_add(length as u64),
                    found_bytes: bytes.len() as u64,
                })?;
                fragments.push(Fragment { offset: at, bytes: start..end });
                at = end;
            }
            [0xfe, 0xff, 0xdd, 0xe0] => break,
            _ => return Err(damaged("a compressed fragment has no head")),
        }
    }
    if fragments.is_empty() {
        return Err(damaged("there are no compressed fragments"));
    }
    let table = fragments.remove(0);
    let first = table.bytes.end;
    fragments.iter_mut().for_each(|fragment| fragment.offset -= first);
    let (offsets, _) = bytes[table.bytes].as_chunks::<4>();
    Ok((offsets.iter().map(|&offset| u32::from_le_bytes(offset) as usize).collect(), fragments))
}

fn by_frame(
    table: &[usize],
    fragments: Vec<Fragment>,
    frames: usize,
) -> Result<Vec<Vec<Range<usize>>>, VolumeError> {
    if frames == 1 {
        return Ok(vec![fragments.into_iter().map(|fragment| fragment.bytes).collect()]);
    }
    if fragments.len() == frames {
        return Ok(fragments.into_iter().map(|fragment| vec![fragment.bytes]).collect());
    }
    let reason = format!("{} compressed fragments do not tell {frames} frames apart", fragments.len());
    if table.len() != frames || fragments.len() < frames {
        return Err(VolumeError::Damaged { reason });
    }
    let mut by_frame = vec![Vec::new(); frames];
    for fragment in fragments {
        let after = table.partition_point(|&offset| offset <= fragment.offset);
        let frame = after.checked_sub(1).and_then(|frame| by_frame.get_mut(frame));
        frame.ok_or_else(|| VolumeError::Damaged { reason: reason.clone() })?.push(fragment.bytes);
    }
    Ok(by_frame)
}
