//! MetaImage headers: `.mha`, and `.mhd` with a separate data file.

use bevy::math::{DAffine3, DMat3, DVec3};

use super::header::{
    ByteSkip, DataLocation, Encoding, GridHeader, ScalarType, checked_dimensions, next_line, parse_array,
    parse_numbers, to_ras,
};
use crate::volume::asset::Rescale;
use crate::volume::error::{VolumeError, excerpt};

/// Reads the header at the beginning of a MetaImage file.
///
/// Its space is LPS, as ITK has it.
///
/// # Errors
///
/// Where the file is not MetaImage, a field is missing or senseless, the image is not
/// three-dimensional or has several channels, or the data are in several files.
pub(crate) fn parse(bytes: &[u8]) -> Result<GridHeader, VolumeError> {
    let fields = Fields::read(bytes)?;
    if let Some(kind) = fields.get("ObjectType")
        && !kind.eq_ignore_ascii_case("Image")
    {
        return Err(VolumeError::field("ObjectType", kind, "must be Image"));
    }
    if let Some(channels) = fields.get("ElementNumberOfChannels")
        && channels != "1"
    {
        let channels = format!("{} channels", excerpt(channels));
        return Err(VolumeError::UnsupportedType(channels));
    }
    let sizes = parse_numbers("DimSize", fields.required("DimSize")?)?;
    let count = fields.required("NDims")?;
    // The format allows ten axes.
    if count.parse() != Ok(sizes.len()) || sizes.len() > 10 {
        let reason = format!("but there are {} sizes", sizes.len());
        return Err(VolumeError::field("NDims", count, reason));
    }
    let compressed = fields.flag(&["CompressedData"])?.unwrap_or(false);
    let encoding = match (fields.flag(&["BinaryData"])?, compressed) {
        (Some(false), true) => {
            return Err(VolumeError::UnsupportedEncoding("compressed text".into()));
        }
        (Some(false), false) => Encoding::Ascii,
        (_, true) => Encoding::Zlib,
        (_, false) => Encoding::Raw,
    };
    let big_endian = fields.flag(&["BinaryDataByteOrderMSB", "ElementByteOrderMSB"])?;
    GridHeader {
        dimensions: checked_dimensions(&sizes)?,
        scalar: scalar_type(fields.required("ElementType")?)?,
        big_endian: big_endian.unwrap_or(false),
        encoding,
        grid_to_patient: fields.grid_to_patient()?,
        rescale: Rescale {
            slope: fields.number("ElementToIntensityFunctionSlope", 1.0)?,
            intercept: fields.number("ElementToIntensityFunctionOffset", 0.0)?,
        },
        data: fields.data_location()?,
        line_skip: 0,
        byte_skip: fields.byte_skip()?,
    }
    .checked()
}

/// The header's fields as written, and where the bytes after it begin.
struct Fields {
    fields: Vec<(String, String)>,
    end: usize,
}

impl Fields {
    fn read(bytes: &[u8]) -> Result<Self, VolumeError> {
        let mut fields: Vec<(String, String)> = Vec::new();
        let mut end = 0;
        while let Some((line, next)) = next_line(bytes, end) {
            end = next;
            let line = String::from_utf8_lossy(line);
            if line.trim().is_empty() {
                continue;
            }
            let Some((name, value)) = line.split_once('=') else {
                if !fields.iter().any(is_signature) {
                    break;
                }
                return Err(VolumeError::field("header line", line, "no field"));
            };
            fields.push((name.trim().to_owned(), value.trim().to_owned()));
            // By the standard the last field: data may follow.
            if name.trim().eq_ignore_ascii_case("ElementDataFile") {
                break;
            }
        }
        let fields = Self { fields, end };
        if !fields.fields.iter().any(is_signature) {
            return Err(VolumeError::NotThisFormat { expected: "a MetaImage file" });
        }
        Ok(fields)
    }

    /// The value of a field, in whatever case its name is written.
    fn get(&self, name: &str) -> Option<&str> {
        let mut found = self.fields.iter().rev();
        found.find(|(field, _)| field.eq_ignore_ascii_case(name)).map(|(_, value)| value.as_str())
    }

    fn required(&self, name: &'static str) -> Result<&str, VolumeError> {
        self.get(name).ok_or_else(|| VolumeError::field(name, "", "the field is missing"))
    }

    /// The first of the names that there is, as so many numbers.
    fn numbers<const N: usize>(&self, names: &[&'static str]) -> Result<Option<[f64; N]>, VolumeError> {
        names.iter().find_map(|name| self.get(name).map(|text| parse_array(name, text))).transpose()
    }

    fn number(&self, name: &'static str, default: f64) -> Result<f64, VolumeError> {
        Ok(self.numbers(&[name])?.map_or(default, |[number]| number))
    }

    /// The first of the names that there is, as truth value.
    fn flag(&self, names: &[&'static str]) -> Result<Option<bool>, VolumeError> {
        let Some((name, text)) = names.iter().find_map(|name| self.get(name).map(|text| (*name, text)))
        else {
            return Ok(None);
        };
        match text.to_ascii_lowercase().as_str() {
            "true" | "1" | "t" => Ok(Some(true)),
            "false" | "0" | "f" => Ok(Some(false)),
            _ => Err(VolumeError::field(name, text, "neither True nor False")),
        }
    }

    fn grid_to_patient(&self) -> Result<DAffine3, VolumeError> {
        let spacing = self.numbers(&["ElementSpacing", "ElementSize"])?;
        let spacing = DVec3::from_array(spacing.unwrap_or([1.0; 3]));
        // Three numbers after three: the directions of the grid's axes.
        let directions = self.numbers(&["TransformMatrix", "Orientation", "Rotation"])?;
        let directions = directions.map_or(DMat3::IDENTITY, |all| DMat3::from_cols_array(&all));
        let origin = self.numbers(&["Offset", "Position", "Origin"])?;
        let origin = DVec3::from_array(origin.unwrap_or([0.0; 3]));
        let in_space = DAffine3::from_mat3_translation(
            DMat3::from_cols(
                directions.x_axis * spacing.x,
                directions.y_axis * spacing.y,
                directions.z_axis * spacing.z,
            ),
            origin,
        );
        Ok(to_ras(in_space, true, true))
    }

    fn byte_skip(&self) -> Result<ByteSkip, VolumeError> {
        let text = self.get("HeaderSize").unwrap_or("0");
        match text.parse::<i64>() {
            Ok(-1) => Ok(ByteSkip::FromEnd),
            Ok(skip) if skip >= 0 => Ok(ByteSkip::FromStart(skip.unsigned_abs())),
            _ => Err(VolumeError::field("HeaderSize", text, "not a number of bytes, or -1")),
        }
    }

    fn data_location(&self) -> Result<DataLocation, VolumeError> {
        let file = self.required("ElementDataFile")?;
        if file.eq_ignore_ascii_case("LOCAL") {
            return Ok(DataLocation::Attached { offset: self.end });
        }
        if file.split_whitespace().next() == Some("LIST") || file.contains('%') {
            let how = format!("several files ({})", excerpt(file));
            return Err(VolumeError::UnsupportedEncoding(how));
        }
        let file = file.to_owned();
        Ok(DataLocation::Detached { file })
    }
}

/// Whether a field tells the format, which has no magic number: every header has one of these.
fn is_signature((name, _): &(String, String)) -> bool {
    name.eq_ignore_ascii_case("ObjectType") || name.eq_ignore_ascii_case("NDims")
}

fn scalar_type(name: &str) -> Result<ScalarType, VolumeError> {
    Ok(match name.to_ascii_uppercase().as_str() {
        "MET_UCHAR" => ScalarType::U8,
        "MET_CHAR" => ScalarType::I8,
        "MET_USHORT" => ScalarType::U16,
        "MET_SHORT" => ScalarType::I16,
        // A MetaImage long has four bytes on every system.
        "MET_UINT" | "MET_ULONG" => ScalarType::U32,
        "MET_INT" | "MET_LONG" => ScalarType::I32,
        "MET_ULONG_LONG" => ScalarType::U64,
        "MET_LONG_LONG" => ScalarType::I64,
        "MET_FLOAT" => ScalarType::F32,
        "MET_DOUBLE" => ScalarType::F64,
        _ => return Err(VolumeError::UnsupportedType(excerpt(name))),
    })
}
