//! NIfTI headers of both versions: `.nii`, `.hdr`, each optionally gzipped as a whole.

use std::borrow::Cow;
use std::io::Read;

use super::decode::Members;
use super::header::{ByteSkip, Components, Encoding, GridHeader, ScalarType, checked_dimensions};
use super::nifti_fields::{Fields, VERSION_1_BYTES};
use super::nifti_geometry::grid_to_patient;
use super::{VolumeReadSettings, nifti2};
use crate::volume::{asset::Rescale, error::VolumeError};

/// Reads the header at the beginning of a `.nii` or `.hdr` file, gzipped or not.
///
/// # Errors
///
/// - The header is cut off, invalid or not NIfTI.
/// - The image is not three-dimensional or has several numbers per voxel.
/// - The image holds several volumes and the settings choose none.
pub(crate) fn parse(bytes: &[u8], settings: &VolumeReadSettings) -> Result<GridHeader, VolumeError> {
    let fields = fields(&header_bytes(bytes)?)?;
    let scalar = scalar_type(&fields)?;
    let (sizes, count) = sizes(&fields)?;
    let vectors = vectors(fields.intent_code).filter(|_| count > 1);
    if let Some(kind) = vectors {
        let kind = format!("{kind} (NIfTI intent {})", fields.intent_code);
        return Err(VolumeError::NotScalar { kind, values: count });
    }
    let along =
        if fields.dim[4] > 1 { "along the fourth axis, time" } else { "along axes beyond the fourth" };
    GridHeader {
        dimensions: checked_dimensions(&sizes)?,
        components: Components { count, index: settings.choose(count, along)?, axes_before: 3 },
        scalar,
        big_endian: fields.big_endian,
        encoding: Encoding::RawOrGzip,
        grid_to_patient: grid_to_patient(&fields)?,
        rescale: rescale(&fields),
        data: fields.data_location(),
        line_skip: 0,
        byte_skip: ByteSkip::FromStart(data_offset(&fields)?),
    }
    .checked()
}

/// The header's decompressed bytes; fewer if the file is shorter.
fn header_bytes(bytes: &[u8]) -> Result<Cow<'_, [u8]>, VolumeError> {
    // The first bytes tell whether a file is gzipped; its name may be wrong.
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return Ok(Cow::Borrowed(bytes));
    }
    let mut start = Vec::new();
    match Members::new(bytes).take(nifti2::HEADER_BYTES as u64).read_to_end(&mut start) {
        Err(error) if error.kind() != std::io::ErrorKind::UnexpectedEof => {
            Err(VolumeError::Damaged { reason: error.to_string() })
        }
        _ => Ok(Cow::Owned(start)),
    }
}

/// The fields of a header of either version.
fn fields(bytes: &[u8]) -> Result<Fields, VolumeError> {
    // Both versions begin with the header's own size.
    let size = bytes.first_chunk().copied().unwrap_or_default();
    let expected = match [i32::from_le_bytes(size), i32::from_be_bytes(size)] {
        sizes if sizes.contains(&nifti2::HEADER_BYTES) => nifti2::HEADER_BYTES as u64,
        _ => VERSION_1_BYTES,
    };
    let found = bytes.len() as u64;
    if found < expected {
        return Err(VolumeError::Truncated { expected_bytes: expected, found_bytes: found });
    }
    if expected == VERSION_1_BYTES { Fields::version_1(bytes) } else { nifti2::fields(bytes) }
}

/// The grid's three sizes, and the number of volumes that the other axes make.
fn sizes(fields: &Fields) -> Result<([u64; 3], u64), VolumeError> {
    let error = |reason: String| {
        let sizes = fields.dim.iter().map(|&size| u64::try_from(size).unwrap_or(0)).collect();
        Err(VolumeError::Dimensions { sizes, reason })
    };
    let [count, ..] = fields.dim;
    if !(3..=7).contains(&count) {
        return error(format!("the image has {count} dimensions, three are needed"));
    }
    let mut sizes = [0; 7];
    for (size, &dim) in sizes.iter_mut().zip(&fields.dim[1..=count as usize]) {
        let Ok(dim) = u64::try_from(dim) else { return error(format!("{dim} is negative")) };
        *size = dim;
    }
    let [x, y, z, rest @ ..] = sizes;
    let volumes = rest.iter().try_fold(1u64, |volumes, &size| volumes.checked_mul(size.max(1)));
    match volumes {
        Some(volumes) => Ok(([x, y, z], volumes)),
        None => error("too many volumes".into()),
    }
}

fn scalar_type(fields: &Fields) -> Result<ScalarType, VolumeError> {
    let code = fields.datatype;
    let not_scalar = |kind: &str, values| {
        Err(VolumeError::NotScalar { kind: format!("{kind} (NIfTI datatype {code})"), values })
    };
    Ok(match code {
        2 => ScalarType::U8,
        4 => ScalarType::I16,
        8 => ScalarType::I32,
        16 => ScalarType::F32,
        64 => ScalarType::F64,
        256 => ScalarType::I8,
        512 => ScalarType::U16,
        768 => ScalarType::U32,
        1024 => ScalarType::I64,
        1280 => ScalarType::U64,
        128 => return not_scalar("a colour image (RGB)", 3),
        2304 => return not_scalar("a colour image (RGBA)", 4),
        32 | 1792 | 2048 => return not_scalar("an image of complex numbers", 2),
        1 => return Err(VolumeError::UnsupportedType("bit (NIfTI datatype 1)".into())),
        1536 => return Err(VolumeError::UnsupportedType("float128 (NIfTI datatype 1536)".into())),
        _ => return Err(VolumeError::UnsupportedType(format!("NIfTI datatype {code}"))),
    })
}

/// Kind of the image if its intent makes a voxel's values belong together.
fn vectors(intent_code: i32) -> Option<&'static str> {
    Some(match intent_code {
        1004 | 1005 => "an image of matrices",
        1006 | 1007 | 2006..=2009 | 2016 | 2017 => "an image of vectors",
        1008 => "a set of points",
        1009 => "a mesh",
        1010 => "an image of quaternions",
        2003 => "a colour image (RGB)",
        2004 => "a colour image (RGBA)",
        _ => return None,
    })
}

/// Offset of the first voxel, bytes, in the (decompressed) file with the data.
fn data_offset(fields: &Fields) -> Result<u64, VolumeError> {
    let (offset, first) = (fields.vox_offset, fields.first_data_byte);
    // Floats skip whole numbers beyond 2^24, and no header is that long.
    let valid = offset.fract() == 0.0 && (0.0..=16_777_216.0).contains(&offset);
    match (valid, offset as u64) {
        // Some programs leave the offset at zero.
        (true, 0) if fields.attached => Ok(first),
        (true, bytes) if !fields.attached || bytes >= first => Ok(bytes),
        _ => Err(VolumeError::field("vox_offset", offset, "not the place of data after the header")),
    }
}

/// The header's scaling; a slope of zero or NaN means that there is no scaling.
fn rescale(fields: &Fields) -> Rescale {
    let (slope, intercept) = (fields.scl_slope, fields.scl_inter);
    if slope == 0.0 || slope.is_nan() {
        return Rescale::default();
    }
    // A NaN intercept is valid only without scaling; `checked` refuses it here.
    Rescale { slope, intercept }
}
