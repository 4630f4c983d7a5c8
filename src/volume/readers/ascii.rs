//! Voxels written as text.

use super::header::{ByteSkip, Components, GridHeader, ScalarType};
use crate::volume::error::VolumeError;

/// Parses the text of the chosen component's voxels into little-endian bytes. The text is numbers separated by
/// white space or commas.
pub(super) fn parse(header: &GridHeader, data: &[u8]) -> Result<Vec<u8>, VolumeError> {
    let ByteSkip::FromStart(skip) = header.byte_skip else {
        return Err(VolumeError::field("byte skip", -1, "text cannot be read from its end"));
    };
    let text = usize::try_from(skip).ok().and_then(|skip| data.get(skip..)).unwrap_or(&[]);
    let words =
        text.split(|&byte| byte.is_ascii_whitespace() || byte == b',').filter(|word| !word.is_empty());
    let expected = header.volume_bytes();
    let Components { count, index, .. } = header.components;
    let (run, voxel_count) = (header.run(), usize::try_from(header.voxels()).unwrap_or(usize::MAX));
    let of_component = (0..).zip(words).filter(|(at, _)| at / run % count == index);
    let mut voxels = Vec::new();
    for (_, word) in of_component.take(voxel_count) {
        push(header.scalar, word, &mut voxels).ok_or_else(|| VolumeError::Damaged {
            reason: format!(
                "{:?} is no number of type {:?}",
                String::from_utf8_lossy(&word[..word.len().min(40)]),
                header.scalar
            ),
        })?;
    }
    let found_bytes = voxels.len() as u64;
    if found_bytes < expected {
        return Err(VolumeError::Truncated { expected_bytes: expected, found_bytes });
    }
    Ok(voxels)
}

/// Appends one number's bytes; `None` if the word is no number of the type.
fn push(scalar: ScalarType, word: &[u8], voxels: &mut Vec<u8>) -> Option<()> {
    let word = std::str::from_utf8(word).ok()?;
    macro_rules! push {
        ($number:ty) => {
            voxels.extend_from_slice(&word.parse::<$number>().ok()?.to_le_bytes())
        };
    }
    match scalar {
        ScalarType::U8 => push!(u8),
        ScalarType::I8 => push!(i8),
        ScalarType::U16 => push!(u16),
        ScalarType::I16 => push!(i16),
        ScalarType::U32 => push!(u32),
        ScalarType::I32 => push!(i32),
        ScalarType::U64 => push!(u64),
        ScalarType::I64 => push!(i64),
        ScalarType::F32 => push!(f32),
        ScalarType::F64 => push!(f64),
    }
    Some(())
}
