//! The fields of a NRRD header, as written.

use std::borrow::Cow;

use bevy::math::DVec3;

use super::header::next_line;
use crate::volume::error::VolumeError;

/// The fields that the reader uses, as written. The last value of a repeated field counts.
#[derive(Debug, Default)]
pub(super) struct Fields {
    pub(super) scalar: Option<String>,
    pub(super) dimension: Option<String>,
    pub(super) sizes: Option<String>,
    pub(super) spacings: Option<String>,
    pub(super) axis_mins: Option<String>,
    pub(super) axis_maxs: Option<String>,
    pub(super) centers: Option<String>,
    pub(super) directions: Option<String>,
    pub(super) kinds: Option<String>,
    pub(super) units: Option<String>,
    pub(super) space: Option<String>,
    pub(super) space_dimension: Option<String>,
    pub(super) space_units: Option<String>,
    pub(super) origin: Option<String>,
    pub(super) endian: Option<String>,
    pub(super) encoding: Option<String>,
    pub(super) line_skip: Option<String>,
    pub(super) byte_skip: Option<String>,
    pub(super) data_file: Option<String>,
}

impl Fields {
    /// Reads the fields, and the start of the bytes after the header.
    pub(super) fn read(bytes: &[u8]) -> Result<(Self, usize), VolumeError> {
        let not_nrrd = VolumeError::NotThisFormat { expected: "a NRRD file of version 1 to 5" };
        let Some((magic, mut at)) = next_line(bytes, 0) else {
            return Err(not_nrrd);
        };
        if !matches!(magic.trim_ascii_end(), [b'N', b'R', b'R', b'D', b'0', b'0', b'0', b'1'..=b'5']) {
            return Err(not_nrrd);
        }
        let mut fields = Self::default();
        while let Some((line, next)) = next_line(bytes, at) {
            at = next;
            if line.is_empty() {
                break;
            }
            let line = text(line);
            // Comments are skipped, and so are `key:=value` lines, which are the writer's own.
            if line.starts_with('#') {
                continue;
            }
            let Some((name, value)) = line.split_once(':') else {
                return Err(VolumeError::field("header line", line, "no field, key or comment"));
            };
            if value.starts_with('=') {
                continue;
            }
            if let Some(field) = fields.named(name.trim()) {
                *field = Some(value.trim().to_owned());
            }
            // Names of files follow, not fields.
            if fields.lists_data_files() {
                break;
            }
        }
        Ok((fields, at))
    }

    /// Whether the data are in several files whose names follow the header.
    pub(super) fn lists_data_files(&self) -> bool {
        let mut words = self.data_file.iter().flat_map(|file| file.split(' '));
        words.next() == Some("LIST")
    }

    /// The field of a name, if the reader uses it.
    fn named(&mut self, name: &str) -> Option<&mut Option<String>> {
        let name = name.to_ascii_lowercase();
        Some(match name.as_str() {
            "type" => &mut self.scalar,
            "dimension" => &mut self.dimension,
            "sizes" => &mut self.sizes,
            "spacings" => &mut self.spacings,
            "axis mins" | "axismins" => &mut self.axis_mins,
            "axis maxs" | "axismaxs" => &mut self.axis_maxs,
            "centers" | "centerings" => &mut self.centers,
            "space directions" => &mut self.directions,
            "kinds" => &mut self.kinds,
            "units" => &mut self.units,
            "space" => &mut self.space,
            "space dimension" => &mut self.space_dimension,
            "space units" => &mut self.space_units,
            "space origin" => &mut self.origin,
            "endian" => &mut self.endian,
            "encoding" => &mut self.encoding,
            "line skip" | "lineskip" => &mut self.line_skip,
            "byte skip" | "byteskip" => &mut self.byte_skip,
            "data file" | "datafile" => &mut self.data_file,
            _ => return None,
        })
    }

    /// The number of a skip; zero if it is not given.
    pub(super) fn number(&self, field: &'static str, text: Option<&str>) -> Result<i64, VolumeError> {
        let text = text.unwrap_or("0");
        text.parse().map_err(|_| VolumeError::field(field, text, "not a whole number"))
    }
}

/// A line's text. A line that is not UTF-8 is taken for Latin-1, in which some programs write `µm`.
fn text(line: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(line) {
        Ok(text) => text.into(),
        Err(_) => line.iter().map(|&byte| char::from(byte)).collect(),
    }
}

/// The error of a missing field.
pub(super) fn missing(field: &'static str) -> VolumeError {
    VolumeError::field(field, "", "the field is missing")
}

/// The text of a required field.
pub(super) fn required<'a>(field: &'static str, text: &'a Option<String>) -> Result<&'a str, VolumeError> {
    text.as_deref().ok_or_else(|| missing(field))
}

/// Parses vectors like `(1,0,0)`. Both `none` and a vector of NaN become `None`.
pub(super) fn vectors(field: &'static str, text: &str) -> Result<Vec<Option<DVec3>>, VolumeError> {
    let error = || VolumeError::field(field, text, "not a list of vectors like (1,0,0), or none");
    let mut vectors = Vec::new();
    let mut rest = text.trim_start();
    while !rest.is_empty() {
        if let Some(after) = rest.strip_prefix("none") {
            vectors.push(None);
            rest = after.trim_start();
            continue;
        }
        let inside = rest.strip_prefix('(').ok_or_else(error)?;
        let (inside, after) = inside.split_once(')').ok_or_else(error)?;
        let numbers: Option<Vec<f64>> = inside.split(',').map(|number| number.trim().parse().ok()).collect();
        let numbers: [f64; 3] = numbers.and_then(|n| n.try_into().ok()).ok_or_else(error)?;
        let unknown = numbers.iter().all(|number| number.is_nan());
        vectors.push((!unknown).then_some(DVec3::from_array(numbers)));
        rest = after.trim_start();
    }
    Ok(vectors)
}

/// Splits a text into words. A word may be in double quotes; an empty word must be.
pub(super) fn quoted_words(text: &str) -> Vec<&str> {
    let mut words = Vec::new();
    let mut rest = text.trim_start();
    while !rest.is_empty() {
        let (word, after) = match rest.strip_prefix('"') {
            Some(quoted) => quoted.split_once('"').unwrap_or((quoted, "")),
            None => rest.split_once(char::is_whitespace).unwrap_or((rest, "")),
        };
        words.push(word);
        rest = after.trim_start();
    }
    words
}
