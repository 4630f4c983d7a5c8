//! RLE: bytes of one significance after the other, each in runs (PackBits).

use crate::volume::error::VolumeError;

/// Decodes a frame of `pixels` numbers of `bytes` bytes each.
pub(super) fn decode(frame: &[u8], pixels: usize, bytes: usize) -> Result<Vec<u32>, VolumeError> {
    let damaged = |reason: String| VolumeError::Damaged { reason: format!("RLE: {reason}") };
    let (numbers, _) = frame.get(..64).unwrap_or_default().as_chunks::<4>();
    let numbers: Vec<_> = numbers.iter().map(|&four| u32::from_le_bytes(four) as usize).collect();
    let [count, starts @ ..] = &numbers[..] else { return Err(damaged("the head is cut off".into())) };
    if *count != bytes {
        return Err(damaged(format!("{count} segments for pixels of {bytes} bytes")));
    }
    let mut words = vec![0; pixels];
    for (segment, &start) in starts[..bytes].iter().enumerate() {
        let end = starts[..bytes].get(segment + 1).copied().unwrap_or(frame.len());
        let runs =
            frame.get(start..end).ok_or_else(|| damaged("a segment is outside of the frame".into()))?;
        // The most significant byte comes first.
        let shift = 8 * (bytes - 1 - segment);
        let found = unpack(runs, &mut words, shift);
        if found < pixels {
            let (expected_bytes, found_bytes) = (pixels as u64, found as u64);
            return Err(VolumeError::Truncated { expected_bytes, found_bytes });
        }
    }
    Ok(words)
}

/// Adds bytes from runs to words. Returns the number of bytes.
fn unpack(mut runs: &[u8], words: &mut [u32], shift: usize) -> usize {
    let mut at = 0;
    let mut put = |byte: u8| {
        if let Some(word) = words.get_mut(at) {
            *word |= u32::from(byte) << shift;
            at += 1;
        }
    };
    while let [control, rest @ ..] = runs {
        let control = *control as i8;
        match (control, rest) {
            (0.., _) => {
                let (bytes, after) = rest.split_at(rest.len().min(control as usize + 1));
                bytes.iter().copied().for_each(&mut put);
                runs = after;
            }
            (-127..0, [byte, after @ ..]) => {
                (0..1 - i32::from(control)).for_each(|_| put(*byte));
                runs = after;
            }
            _ => runs = rest,
        }
    }
    at
}
