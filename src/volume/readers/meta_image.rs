//! MetaImage headers: `.mha`, and `.mhd` with a separate data file.

use bevy::math::{DAffine3, DMat3, DVec3};

use super::VolumeReadSettings;
use super::header::{
    ByteSkip, Components, DataLocation, Encoding, GridHeader, ScalarType, checked_dimensions, next_line,
    parse_count, parse_numbers, to_ras,
};
use super::length_unit::millimetres;
use crate::volume::{
    asset::Rescale,
    error::{VolumeError, excerpt},
};

/// Reads the header at the beginning of a MetaImage file.
///
/// The file's space is LPS, as in ITK.
///
/// # Errors
///
/// - The file is not MetaImage, or a field is missing or invalid.
/// - The image is not three-dimensional or has several channels.
/// - The image holds several volumes and the settings choose none.
/// - The data are in several files.
pub(crate) fn parse(bytes: &[u8], settings: &VolumeReadSettings) -> Result<GridHeader, VolumeError> {
    let fields = Fields::read(bytes)?;
    if let Some(kind) = fields.get("ObjectType")
        && !kind.eq_ignore_ascii_case("Image")
    {
        return Err(VolumeError::field("ObjectType", kind, "must be Image"));
    }
    fields.check_channels()?;
    let sizes: Vec<u64> = parse_numbers("DimSize", fields.required("DimSize")?)?;
    let axes = sizes.len();
    let count = fields.required("NDims")?;
    // The format allows ten axes.
    if count.parse() != Ok(axes) || axes > 10 {
        return Err(VolumeError::field("NDims", count, format!("but there are {axes} sizes")));
    }
    let (space, beyond) = sizes.split_at(axes.min(3));
    let count =
        beyond.iter().try_fold(1u64, |count, &size| count.checked_mul(size)).filter(|&count| count > 0);
    let Some(count) = count else {
        let reason = "no volumes, or too many".into();
        return Err(VolumeError::Dimensions { sizes, reason });
    };
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
        dimensions: checked_dimensions(space)?,
        components: Components {
            count,
            index: settings.choose(count, "along the fourth axis")?,
            axes_before: 3,
        },
        scalar: scalar_type(fields.required("ElementType")?)?,
        big_endian: big_endian.unwrap_or(false),
        encoding,
        grid_to_patient: fields.grid_to_patient(axes)?,
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

/// The header's fields as written, and the start of the bytes after it.
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
            // The standard makes this the last field: data may follow.
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

    /// The value of a field, whatever the case of its name.
    fn get(&self, name: &str) -> Option<&str> {
        let mut found = self.fields.iter().rev();
        found.find(|(field, _)| field.eq_ignore_ascii_case(name)).map(|(_, value)| value.as_str())
    }

    fn required(&self, name: &'static str) -> Result<&str, VolumeError> {
        self.get(name).ok_or_else(|| VolumeError::field(name, "", "the field is missing"))
    }

    /// The first present field of `names`, as `count` numbers.
    fn numbers(&self, names: &[&'static str], count: usize) -> Result<Option<Vec<f64>>, VolumeError> {
        names.iter().find_map(|name| self.get(name).map(|text| parse_count(name, text, count))).transpose()
    }

    fn number(&self, name: &'static str, default: f64) -> Result<f64, VolumeError> {
        Ok(self.numbers(&[name], 1)?.map_or(default, |numbers| numbers[0]))
    }

    /// Refuses images of several values per voxel.
    fn check_channels(&self) -> Result<(), VolumeError> {
        let Some(text) = self.get("ElementNumberOfChannels") else { return Ok(()) };
        match text.parse::<u64>() {
            Ok(1) => Ok(()),
            Ok(values @ 2..) => {
                let kind = "an image of several channels (ElementNumberOfChannels)".into();
                Err(VolumeError::NotScalar { kind, values })
            }
            _ => Err(VolumeError::field("ElementNumberOfChannels", text, "not a number of channels")),
        }
    }

    /// The first present field of `names`, as a truth value.
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

    /// Transform from indices along the first three of `axes` axes to RAS+ millimetres.
    fn grid_to_patient(&self, axes: usize) -> Result<DAffine3, VolumeError> {
        let first_three = |numbers: &[f64]| DVec3::from_slice(&numbers[..3]);
        let spacing = self.numbers(&["ElementSpacing", "ElementSize"], axes)?;
        let spacing = spacing.map_or(DVec3::ONE, |spacing| first_three(&spacing));
        // Every group of `axes` numbers is the direction of one axis of the grid.
        let directions = self.numbers(&["TransformMatrix", "Orientation", "Rotation"], axes * axes)?;
        let directions = directions.map_or(DMat3::IDENTITY, |all| {
            let column = |index: usize| first_three(&all[index * axes..]);
            DMat3::from_cols(column(0), column(1), column(2))
        });
        let origin = self.numbers(&["Offset", "Position", "Origin"], axes)?;
        let origin = origin.map_or(DVec3::ZERO, |origin| first_three(&origin));
        let unit = millimetres("DistanceUnits", self.get("DistanceUnits").unwrap_or_default())?;
        let in_units = DAffine3::from_mat3_translation(directions * DMat3::from_diagonal(spacing), origin);
        Ok(to_ras(DAffine3::from_scale(DVec3::splat(unit)) * in_units, true, true))
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

/// Whether a field tells the format, which has no magic number. Every header has one of these fields.
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
