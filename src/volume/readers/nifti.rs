//! NIfTI-1 headers: `.nii`, `.hdr`, each perhaps gzipped as a whole.

use std::borrow::Cow;
use std::io::Read;

use bevy::math::{DAffine3, DMat3, DQuat, DVec3};
use nifti::typedef::{NiftiType, Unit};
use nifti::{Endianness, NiftiHeader};

use super::decode::Members;
use super::header::{ByteSkip, DataLocation, Encoding, GridHeader, ScalarType, checked_dimensions};
use crate::volume::asset::Rescale;
use crate::volume::error::VolumeError;

/// Bytes of a NIfTI-1 header.
const HEADER_BYTES: u64 = 348;
/// The first byte that data in the header's file can be at: the header and four bytes of flags.
const FIRST_DATA_BYTE: u64 = 352;

/// Reads the header at the beginning of a `.nii` or `.hdr` file, gzipped or not.
///
/// # Errors
///
/// Where the header is cut off, not NIfTI-1 or senseless, or the image is not three-dimensional or
/// not of one number per voxel.
pub(crate) fn parse(bytes: &[u8]) -> Result<GridHeader, VolumeError> {
    let start = header_bytes(bytes)?;
    let not_nifti = VolumeError::NotThisFormat { expected: "a NIfTI-1 file" };
    // The crate takes the byte order from the number of dimensions; the header's own size, which it
    // does not look at, must agree.
    let size = start.first_chunk().copied().unwrap_or_default();
    if [i32::from_le_bytes(size), i32::from_be_bytes(size)].contains(&540) {
        let reason = "NIfTI-2 cannot be read";
        return Err(VolumeError::field("sizeof_hdr", 540, reason));
    }
    if (start.len() as u64) < HEADER_BYTES {
        return Err(VolumeError::Truncated { expected_bytes: HEADER_BYTES, found_bytes: start.len() as u64 });
    }
    let Ok(header) = NiftiHeader::from_reader(start.as_ref()) else {
        return Err(not_nifti);
    };
    if i64::from(header.sizeof_hdr) != HEADER_BYTES as i64 {
        return Err(not_nifti);
    }
    let attached = &header.magic == b"n+1\0";
    GridHeader {
        dimensions: checked_dimensions(&sizes(&header)?)?,
        scalar: scalar_type(&header)?,
        big_endian: header.endianness == Endianness::Big,
        encoding: Encoding::RawOrGzip,
        grid_to_patient: grid_to_patient(&header)?,
        rescale: rescale(&header)?,
        data: if attached { DataLocation::Attached { offset: 0 } } else { DataLocation::NiftiPair },
        line_skip: 0,
        byte_skip: ByteSkip::FromStart(data_offset(&header, attached)?),
    }
    .checked()
}

/// The header's bytes, decompressed: fewer where the file is shorter.
fn header_bytes(bytes: &[u8]) -> Result<Cow<'_, [u8]>, VolumeError> {
    // Whether a file is gzipped shows in its first bytes; its name may lie.
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return Ok(Cow::Borrowed(bytes));
    }
    let mut start = Vec::new();
    match Members::new(bytes).take(HEADER_BYTES).read_to_end(&mut start) {
        Err(error) if error.kind() != std::io::ErrorKind::UnexpectedEof => {
            Err(VolumeError::Damaged { reason: error.to_string() })
        }
        _ => Ok(Cow::Owned(start)),
    }
}

/// The three sizes, if all axes beyond the third have size one.
fn sizes(header: &NiftiHeader) -> Result<Vec<u64>, VolumeError> {
    let error =
        |reason: String| VolumeError::Dimensions { sizes: header.dim.map(u64::from).to_vec(), reason };
    // Sizes are signed in the format; the crate reads them unsigned.
    if let Some(size) = header.dim.iter().find(|&&size| size > i16::MAX as u16) {
        return Err(error(format!("{} is negative", *size as i16)));
    }
    let count = usize::from(header.dim[0]);
    if !(3..=7).contains(&count) {
        return Err(error(format!("the image has {count} dimensions, three are needed")));
    }
    let (space, rest) = header.dim[1..=count].split_at(3);
    let volumes: u64 = rest.iter().map(|&size| u64::from(size.max(1))).product();
    if volumes != 1 {
        return Err(error(format!("the image has {count} dimensions with {volumes} volumes, one is needed")));
    }
    Ok(space.iter().map(|&size| size.into()).collect())
}

fn scalar_type(header: &NiftiHeader) -> Result<ScalarType, VolumeError> {
    let Ok(data_type) = header.data_type() else {
        let code = header.datatype;
        return Err(VolumeError::UnsupportedType(format!("NIfTI code {code}")));
    };
    Ok(match data_type {
        NiftiType::Uint8 => ScalarType::U8,
        NiftiType::Int8 => ScalarType::I8,
        NiftiType::Uint16 => ScalarType::U16,
        NiftiType::Int16 => ScalarType::I16,
        NiftiType::Uint32 => ScalarType::U32,
        NiftiType::Int32 => ScalarType::I32,
        NiftiType::Uint64 => ScalarType::U64,
        NiftiType::Int64 => ScalarType::I64,
        NiftiType::Float32 => ScalarType::F32,
        NiftiType::Float64 => ScalarType::F64,
        other => return Err(VolumeError::UnsupportedType(format!("{other:?}"))),
    })
}

/// The first voxel's byte in the (decompressed) file with the data.
fn data_offset(header: &NiftiHeader, attached: bool) -> Result<u64, VolumeError> {
    let offset = header.vox_offset;
    // Whole numbers beyond 2^24 are not all floats, and no header is that long.
    let valid = offset.fract() == 0.0 && (0.0..=16_777_216.0).contains(&offset);
    match (valid, offset as u64) {
        // Some programs leave it at zero.
        (true, 0) if attached => Ok(FIRST_DATA_BYTE),
        (true, bytes) if !attached || bytes >= FIRST_DATA_BYTE => Ok(bytes),
        _ => Err(VolumeError::field("vox_offset", offset, "not the place of data after the header")),
    }
}

/// The header's scaling; a slope of zero or NaN means that there is none.
fn rescale(header: &NiftiHeader) -> Result<Rescale, VolumeError> {
    let (slope, intercept) = (f64::from(header.scl_slope), f64::from(header.scl_inter));
    if slope == 0.0 || slope.is_nan() {
        return Ok(Rescale::default());
    }
    // An intercept of NaN goes with a slope of NaN only.
    Ok(Rescale { slope, intercept })
}

/// The sform where there is one, else the qform, else the spacings alone.
fn grid_to_patient(header: &NiftiHeader) -> Result<DAffine3, VolumeError> {
    let in_units = if header.sform_code > 0 {
        let [x, y, z] = [header.srow_x, header.srow_y, header.srow_z].map(|row| row.map(f64::from));
        let column = |index: usize| DVec3::new(x[index], y[index], z[index]);
        DAffine3::from_cols(column(0), column(1), column(2), column(3))
    } else {
        let spacing = spacing(header)?;
        if header.qform_code > 0 { qform(header, spacing)? } else { DAffine3::from_scale(spacing) }
    };
    let to_millimetres = match header.xyzt_to_space() {
        Ok(Unit::Meter) => 1e3,
        Ok(Unit::Micron) => 1e-3,
        _ => 1.0,
    };
    Ok(DAffine3::from_scale(DVec3::splat(to_millimetres)) * in_units)
}

/// The spacings, in the header's unit; some programs write them negative, which says nothing.
fn spacing(header: &NiftiHeader) -> Result<DVec3, VolumeError> {
    let [_, x, y, z, ..] = header.pixdim.map(|size| f64::from(size).abs());
    let spacing = DVec3::new(x, y, z);
    if spacing.is_finite() && spacing.cmpgt(DVec3::ZERO).all() {
        return Ok(spacing);
    }
    Err(VolumeError::field("pixdim", format!("{x} {y} {z}"), "spacings must be finite and not zero"))
}

/// The rotation that a quaternion gives, with the third axis reversed where `pixdim[0]` is negative.
fn qform(header: &NiftiHeader, spacing: DVec3) -> Result<DAffine3, VolumeError> {
    let [b, c, d] = [header.quatern_b, header.quatern_c, header.quatern_d].map(f64::from);
    let square = b * b + c * c + d * d;
    // Three rounded floats may be a little longer than one; normalising is what the standard does.
    if square.is_nan() || square > 1.01 {
        return Err(VolumeError::field("quatern", format!("{b} {c} {d}"), "not part of a unit quaternion"));
    }
    let a = (1.0 - square).max(0.0).sqrt();
    let rotation = DMat3::from_quat(DQuat::from_xyzw(b, c, d, a).normalize());
    let third = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
    let [x, y, z] = [header.quatern_x, header.quatern_y, header.quatern_z].map(f64::from);
    Ok(DAffine3::from_mat3_translation(
        rotation * DMat3::from_diagonal(spacing * DVec3::new(1.0, 1.0, third)),
        DVec3::new(x, y, z),
    ))
}
