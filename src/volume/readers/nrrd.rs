//! NRRD headers, versions 1 to 5: `.nrrd`, and `.nhdr` with a separate data file.

use bevy::math::{DAffine3, DMat3, DVec3};

use super::header::{
    ByteSkip, DataLocation, Encoding, GridHeader, ScalarType, checked_dimensions, parse_numbers, to_ras,
};
use super::nrrd_fields::{Fields, missing, required, vectors};
use crate::volume::asset::Rescale;
use crate::volume::error::{VolumeError, excerpt};

/// Reads the header at the beginning of a NRRD file.
///
/// Axes of size one beyond three are dropped. Where the header names no patient space, its axes are
/// taken for RAS; spacings that it gives as unknown (NaN) are one millimetre.
///
/// # Errors
///
/// Where the file is not NRRD, a field is missing or senseless, the grid is not three-dimensional,
/// or the data are in several files or an encoding other than raw, gzip and text.
pub(crate) fn parse(bytes: &[u8]) -> Result<GridHeader, VolumeError> {
    let (fields, end) = Fields::read(bytes)?;
    let mut axes = fields.axes()?;
    while axes.len() > 3 {
        drop_axis(&mut axes)?;
    }
    let sizes: Vec<u64> = axes.iter().map(|axis| axis.size).collect();
    let scalar = fields.scalar_type()?;
    let encoding = fields.encoding()?;
    let byte_skip = match fields.number("byte skip", fields.byte_skip.as_deref())? {
        -1 => ByteSkip::FromEnd,
        skip => ByteSkip::FromStart(
            u64::try_from(skip).map_err(|_| VolumeError::field("byte skip", skip, "must not be below -1"))?,
        ),
    };
    let line_skip = fields.number("line skip", fields.line_skip.as_deref())?;
    GridHeader {
        dimensions: checked_dimensions(&sizes)?,
        scalar,
        big_endian: fields.big_endian(scalar, encoding)?,
        encoding,
        grid_to_patient: fields.grid_to_patient(&axes)?,
        rescale: Rescale::default(),
        data: fields.data_location(end)?,
        line_skip: u64::try_from(line_skip)
            .map_err(|_| VolumeError::field("line skip", line_skip, "must not be negative"))?,
        byte_skip,
    }
    .checked()
}

/// One axis of the array.
#[derive(Debug)]
struct Axis {
    size: u64,
    spacing: Option<f64>,
    /// Its direction in space, scaled by the spacing; `None` where it has none.
    direction: Option<DVec3>,
}

/// Drops the first or the last axis, if its size is one; rather one without a direction in space.
fn drop_axis(axes: &mut Vec<Axis>) -> Result<(), VolumeError> {
    let single = |axis: &Axis| axis.size == 1;
    let spare = |axis: &Axis| single(axis) && axis.direction.is_none();
    let (first, last) = (axes.first(), axes.last());
    let first_instead = first.is_some_and(spare) && !last.is_some_and(spare);
    if last.is_some_and(single) && !first_instead {
        axes.pop();
    } else if first.is_some_and(single) {
        axes.remove(0);
    } else {
        let count = axes.len();
        return Err(VolumeError::Dimensions {
            sizes: axes.iter().map(|axis| axis.size).collect(),
            reason: format!("the array has {count} dimensions, three are needed"),
        });
    }
    Ok(())
}

impl Fields {
    /// The array's axes, all of them.
    fn axes(&self) -> Result<Vec<Axis>, VolumeError> {
        let dimension = required("dimension", &self.dimension)?;
        let sizes: Vec<u64> = parse_numbers("sizes", required("sizes", &self.sizes)?)?;
        // The standard allows sixteen axes.
        if dimension.parse() != Ok(sizes.len()) || sizes.len() > 16 {
            let count = sizes.len();
            let reason = format!("but there are {count} sizes");
            return Err(VolumeError::field("dimension", dimension, reason));
        }
        if sizes.len() < 3 {
            let count = sizes.len();
            return Err(VolumeError::Dimensions {
                sizes,
                reason: format!("the array has {count} dimensions, three are needed"),
            });
        }
        let mut axes: Vec<Axis> =
            sizes.into_iter().map(|size| Axis { size, spacing: None, direction: None }).collect();
        let per_axis = |field, text: &str, count: usize| {
            let count = format!("{count} values are given");
            Err(VolumeError::field(field, text, count))
        };
        if let Some(text) = &self.spacings {
            let spacings: Vec<f64> = parse_numbers("spacings", text)?;
            if spacings.len() != axes.len() {
                return per_axis("spacings", text, spacings.len());
            }
            for (axis, spacing) in axes.iter_mut().zip(spacings) {
                axis.spacing = Some(spacing).filter(|spacing| !spacing.is_nan());
            }
        }
        if let Some(text) = &self.directions {
            let directions = vectors("space directions", text)?;
            if directions.len() != axes.len() {
                return per_axis("space directions", text, directions.len());
            }
            for (axis, direction) in axes.iter_mut().zip(directions) {
                axis.direction = direction;
            }
        }
        Ok(axes)
    }

    /// From indices along the three axes that are left to RAS+ millimetres.
    fn grid_to_patient(&self, axes: &[Axis]) -> Result<DAffine3, VolumeError> {
        if let Some(text) = self.space_dimension.as_deref().filter(|text| *text != "3") {
            return Err(VolumeError::field("space dimension", text, "must be 3"));
        }
        let (flip_x, flip_y) = match &self.space {
            Some(space) => flips(space)?,
            None => (false, false),
        };
        let mut columns = [DVec3::ZERO; 3];
        for (index, (column, axis)) in columns.iter_mut().zip(axes).enumerate() {
            *column = match axis.direction {
                Some(direction) => direction,
                None if self.directions.is_some() => {
                    let text = self.directions.as_deref().unwrap_or_default();
                    let reason = "an axis of the grid has no direction";
                    return Err(VolumeError::field("space directions", text, reason));
                }
                None => DVec3::AXES[index] * axis.spacing.unwrap_or(1.0),
            };
        }
        let origin = match &self.origin {
            Some(text) => match vectors("space origin", text)?.as_slice() {
                [Some(origin)] => *origin,
                // One of NaNs, which the standard means by "unknown".
                [None] => DVec3::ZERO,
                _ => return Err(VolumeError::field("space origin", text, "one is needed")),
            },
            None => DVec3::ZERO,
        };
        let [x, y, z] = columns;
        let in_space = DAffine3::from_mat3_translation(DMat3::from_cols(x, y, z), origin);
        Ok(to_ras(in_space, flip_x, flip_y))
    }

    fn scalar_type(&self) -> Result<ScalarType, VolumeError> {
        let text = required("type", &self.scalar)?;
        let name = text.to_ascii_lowercase();
        let words: Vec<&str> = name.split_whitespace().collect();
        Ok(match words.join(" ").as_str() {
            "uchar" | "unsigned char" | "uint8" | "uint8_t" => ScalarType::U8,
            "signed char" | "int8" | "int8_t" => ScalarType::I8,
            "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => ScalarType::U16,
            "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => {
                ScalarType::I16
            }
            "uint" | "unsigned int" | "uint32" | "uint32_t" => ScalarType::U32,
            "int" | "signed int" | "int32" | "int32_t" => ScalarType::I32,
            "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => {
                ScalarType::U64
            }
            "longlong"
            | "long long"
            | "long long int"
            | "signed long long"
            | "signed long long int"
            | "int64"
            | "int64_t" => ScalarType::I64,
            "float" => ScalarType::F32,
            "double" => ScalarType::F64,
            _ => return Err(VolumeError::UnsupportedType(excerpt(text))),
        })
    }

    fn encoding(&self) -> Result<Encoding, VolumeError> {
        let text = required("encoding", &self.encoding)?;
        Ok(match text.to_ascii_lowercase().as_str() {
            "raw" => Encoding::Raw,
            "gzip" | "gz" => Encoding::Gzip,
            "ascii" | "text" | "txt" => Encoding::Ascii,
            _ => return Err(VolumeError::UnsupportedEncoding(excerpt(text))),
        })
    }

    /// The byte order, which must be given where it matters.
    fn big_endian(&self, scalar: ScalarType, encoding: Encoding) -> Result<bool, VolumeError> {
        let matters = scalar.bytes() > 1 && encoding != Encoding::Ascii;
        match self.endian.as_deref() {
            Some(text) if text.eq_ignore_ascii_case("big") => Ok(true),
            Some(text) if text.eq_ignore_ascii_case("little") => Ok(false),
            None if !matters => Ok(false),
            None => Err(missing("endian")),
            Some(text) => Err(VolumeError::field("endian", text, "neither big nor little")),
        }
    }

    fn data_location(&self, end: usize) -> Result<DataLocation, VolumeError> {
        let Some(file) = &self.data_file else {
            return Ok(DataLocation::Attached { offset: end });
        };
        if self.lists_data_files() || file.contains('%') {
            let how = format!("several files ({})", excerpt(file));
            return Err(VolumeError::UnsupportedEncoding(how));
        }
        Ok(DataLocation::Detached { file: file.clone() })
    }
}

/// Whether a space's first and second axis point against those of RAS.
fn flips(space: &str) -> Result<(bool, bool), VolumeError> {
    Ok(match space.to_ascii_lowercase().as_str() {
        "right-anterior-superior" | "ras" => (false, false),
        "left-anterior-superior" | "las" => (true, false),
        "left-posterior-superior" | "lps" => (true, true),
        // Not the patient's but the scanner's axes, or no one's: taken as they are.
        "scanner-xyz" | "3d-right-handed" | "3d-left-handed" => (false, false),
        _ => {
            return Err(VolumeError::field("space", space, "not a known space of three dimensions"));
        }
    })
}
