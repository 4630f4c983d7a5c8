//! Units of length, as headers spell them.

use crate::volume::error::VolumeError;

/// Millimetres in the unit that a header field names.
///
/// Names and symbols are read in any case, singular or plural, in British or American spelling. A unit that the
/// header calls unknown, or a voxel, counts as a millimetre.
///
/// # Errors
///
/// [`VolumeError::Field`] names the field and a unit that is not known.
pub(super) fn millimetres(field: &'static str, unit: &str) -> Result<f64, VolumeError> {
    let name = unit.trim().to_lowercase();
    let known = match name.as_str() {
        "" | "?" | "???" | "none" | "unknown" | "pixel" | "pixels" | "voxel" | "voxels" => Some(1.0),
        "micron" | "microns" => Some(1e-3),
        "å" | "angstrom" | "angstroms" | "ångström" | "ångströms" => Some(1e-7),
        "in" | "inch" | "inches" => Some(25.4),
        "ft" | "foot" | "feet" => Some(304.8),
        name => metric(name),
    };
    known.ok_or_else(|| VolumeError::field(field, unit, "not a known unit of length"))
}

/// Millimetres in a metre with a prefix; `name` is in lower case.
fn metric(name: &str) -> Option<f64> {
    let metre = ["metres", "meters", "metre", "meter", "m"];
    Some(match metre.iter().find_map(|metre| name.strip_suffix(metre))? {
        "k" | "kilo" => 1e6,
        "" => 1e3,
        "d" | "deci" => 1e2,
        "c" | "centi" => 1e1,
        "m" | "milli" => 1.0,
        // Unicode has a micro sign and a Greek letter.
        "u" | "\u{b5}" | "\u{3bc}" | "micro" => 1e-3,
        "n" | "nano" => 1e-6,
        "p" | "pico" => 1e-9,
        _ => return None,
    })
}
