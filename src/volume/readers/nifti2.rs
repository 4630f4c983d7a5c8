//! NIfTI-2 headers: 540 bytes, the fields of NIfTI-1 in another order and wider.

use super::nifti_fields::{Fields, not_nifti};
use crate::volume::error::VolumeError;

/// Bytes of the header, which begins with this number.
pub(super) const HEADER_BYTES: i32 = 540;

/// The fields of a header in either byte order.
///
/// # Errors
///
/// If the magic is not NIfTI-2's. The magic's end shows damage by programs that take the file for text.
pub(super) fn fields(bytes: &[u8]) -> Result<Fields, VolumeError> {
    let big_endian = bytes.starts_with(&HEADER_BYTES.to_be_bytes());
    let reader = Reader { bytes, big_endian };
    let attached = match &reader.bytes_at::<8>(4) {
        b"n+2\0\r\n\x1a\n" => true,
        b"ni2\0\r\n\x1a\n" => false,
        _ => return Err(not_nifti()),
    };
    Ok(Fields {
        big_endian,
        attached,
        first_data_byte: HEADER_BYTES as u64 + 4,
        dim: reader.array(16, i64::from_le_bytes),
        intent_code: reader.number(504, i32::from_le_bytes),
        datatype: reader.number(12, i16::from_le_bytes),
        pixdim: reader.array(104, f64::from_le_bytes),
        vox_offset: reader.number(168, i64::from_le_bytes) as f64,
        scl_slope: reader.number(176, f64::from_le_bytes),
        scl_inter: reader.number(184, f64::from_le_bytes),
        xyzt_units: reader.number(500, i32::from_le_bytes),
        qform_code: reader.number(344, i32::from_le_bytes),
        sform_code: reader.number(348, i32::from_le_bytes),
        quatern: reader.array(352, f64::from_le_bytes),
        qoffset: reader.array(376, f64::from_le_bytes),
        srow: [400, 432, 464].map(|row| reader.array(row, f64::from_le_bytes)),
    })
}

struct Reader<'a> {
    bytes: &'a [u8],
    big_endian: bool,
}

impl Reader<'_> {
    /// The bytes from `at` on; zeros past the end. Callers have checked the header's length.
    fn bytes_at<const N: usize>(&self, at: usize) -> [u8; N] {
        self.bytes.get(at..).and_then(|rest| rest.first_chunk()).copied().unwrap_or([0; N])
    }

    fn number<T, const N: usize>(&self, at: usize, from_le_bytes: fn([u8; N]) -> T) -> T {
        let mut bytes = self.bytes_at(at);
        if self.big_endian {
            bytes.reverse();
        }
        from_le_bytes(bytes)
    }

    fn array<T, const N: usize, const COUNT: usize>(
        &self,
        at: usize,
        from_le_bytes: fn([u8; N]) -> T,
    ) -> [T; COUNT] {
        std::array::from_fn(|index| self.number(at + index * N, from_le_bytes))
    }
}
