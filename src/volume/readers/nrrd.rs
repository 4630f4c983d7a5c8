//! NRRD headers, versions 1 to 5: `.nrrd`, and `.nhdr` with a separate data file.

use super::VolumeReadSettings;
use super::header::{ByteSkip, DataLocation, Encoding, GridHeader, ScalarType};
use super::nrrd_axes::Grid;
use super::nrrd_fields::{Fields, missing, required};
use super::nrrd_space::grid_to_patient;
use crate::volume::{
    asset::Rescale,
    error::{VolumeError, excerpt},
};

/// Reads the header at the beginning of a NRRD file.
///
/// Axes of size one beyond three are dropped. If the header names no patient space, its axes are taken for
/// RAS. Spacings that the header gives as unknown (NaN) are one millimetre.
///
/// # Errors
///
/// - The file is not NRRD, or a field is missing or invalid.
/// - The grid is not three-dimensional or has several numbers per voxel.
/// - The file holds several volumes and the settings choose none.
/// - The data are in several files, or in an encoding other than raw, gzip and text.
pub(crate) fn parse(bytes: &[u8], settings: &VolumeReadSettings) -> Result<GridHeader, VolumeError> {
    let (fields, end) = Fields::read(bytes)?;
    let grid = Grid::new(&fields, settings)?;
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
        dimensions: grid.dimensions,
        components: grid.components,
        scalar,
        big_endian: fields.big_endian(scalar, encoding)?,
        encoding,
        grid_to_patient: grid_to_patient(&fields, &grid.axes)?,
        rescale: Rescale::default(),
        data: fields.data_location(end)?,
        line_skip: u64::try_from(line_skip)
            .map_err(|_| VolumeError::field("line skip", line_skip, "must not be negative"))?,
        byte_skip,
    }
    .checked()
}

impl Fields {
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

    /// Whether the data are big-endian. The header must give the byte order if it matters.
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
