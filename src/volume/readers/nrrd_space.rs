//! Places of a NRRD file's voxels in the patient.

use bevy::math::{DAffine3, DMat3, DVec3};

use super::header::to_ras;
use super::length_unit::millimetres;
use super::nrrd_axes::Axis;
use super::nrrd_fields::{Fields, quoted_words, vectors};
use crate::volume::error::VolumeError;

/// Transform from indices along the three axes of the grid to RAS+ millimetres.
pub(super) fn grid_to_patient(fields: &Fields, axes: &[Axis; 3]) -> Result<DAffine3, VolumeError> {
    if let Some(text) = fields.space_dimension.as_deref().filter(|text| *text != "3") {
        return Err(VolumeError::field("space dimension", text, "must be 3"));
    }
    let (flip_x, flip_y) = match &fields.space {
        Some(space) => flips(space)?,
        None => (false, false),
    };
    let columns =
        DMat3::from_cols(column(fields, axes, 0)?, column(fields, axes, 1)?, column(fields, axes, 2)?);
    let origin = origin(fields)?;
    let in_millimetres = match &fields.space_units {
        Some(text) => {
            DAffine3::from_scale(space_units(text)?) * DAffine3::from_mat3_translation(columns, origin)
        }
        None => in_axis_units(axes, columns, origin)?,
    };
    Ok(to_ras(in_millimetres, flip_x, flip_y))
}

/// The step along an axis of the grid, in the header's units.
fn column(fields: &Fields, axes: &[Axis; 3], index: usize) -> Result<DVec3, VolumeError> {
    match (axes[index].direction, &fields.directions) {
        (Some(direction), _) => Ok(direction),
        (None, Some(text)) => {
            let reason = "an axis of the grid has no direction";
            Err(VolumeError::field("space directions", text, reason))
        }
        (None, None) => Ok(DVec3::AXES[index] * axes[index].spacing.unwrap_or(1.0)),
    }
}

fn origin(fields: &Fields) -> Result<DVec3, VolumeError> {
    let Some(text) = &fields.origin else { return Ok(DVec3::ZERO) };
    match vectors("space origin", text)?.as_slice() {
        [Some(origin)] => Ok(*origin),
        // A vector of NaN, which the standard calls "unknown".
        [None] => Ok(DVec3::ZERO),
        _ => Err(VolumeError::field("space origin", text, "one is needed")),
    }
}

/// Millimetres in the units of the space's three axes.
fn space_units(text: &str) -> Result<DVec3, VolumeError> {
    let units = quoted_words(text);
    let scales: Result<Vec<f64>, _> = units.iter().map(|unit| millimetres("space units", unit)).collect();
    let scales: [f64; 3] =
        scales?.try_into().map_err(|_| VolumeError::field("space units", text, "three are needed"))?;
    Ok(DVec3::from_array(scales))
}

/// Converts a transform in units of the axes, which a header without space units may give, to millimetres.
fn in_axis_units(axes: &[Axis; 3], columns: DMat3, origin: DVec3) -> Result<DAffine3, VolumeError> {
    let mut scales = DVec3::ONE;
    for (index, axis) in axes.iter().enumerate() {
        scales[index] = millimetres("units", axis.unit.as_deref().unwrap_or_default())?;
    }
    if origin != DVec3::ZERO && scales != DVec3::splat(scales.x) {
        let reason = "in no unit: those of the axes differ";
        return Err(VolumeError::field("space origin", origin, reason));
    }
    Ok(DAffine3::from_mat3_translation(columns * DMat3::from_diagonal(scales), origin * scales.x))
}

/// Whether a space's first and second axes point against the axes of RAS.
fn flips(space: &str) -> Result<(bool, bool), VolumeError> {
    Ok(match space.to_ascii_lowercase().as_str() {
        "right-anterior-superior" | "ras" => (false, false),
        "left-anterior-superior" | "las" => (true, false),
        "left-posterior-superior" | "lps" => (true, true),
        // The axes are the scanner's or arbitrary, not the patient's: they are taken as they are.
        "scanner-xyz" | "3d-right-handed" | "3d-left-handed" => (false, false),
        _ => {
            return Err(VolumeError::field("space", space, "not a known space of three dimensions"));
        }
    })
}
