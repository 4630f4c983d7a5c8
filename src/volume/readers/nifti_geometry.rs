//! Places of a NIfTI file's voxels in the patient.

use bevy::math::{DAffine3, DMat3, DQuat, DVec3};

use super::nifti_fields::Fields;
use crate::volume::error::VolumeError;

/// Transform from voxel indices to RAS+ millimetres, NIfTI's own axes.
///
/// It is the sform if the header has one, else the qform, else the spacings alone.
pub(super) fn grid_to_patient(fields: &Fields) -> Result<DAffine3, VolumeError> {
    let in_units = if fields.sform_code > 0 {
        let [x, y, z] = fields.srow;
        let column = |index: usize| DVec3::new(x[index], y[index], z[index]);
        DAffine3::from_cols(column(0), column(1), column(2), column(3))
    } else {
        let spacing = spacing(fields)?;
        if fields.qform_code > 0 { qform(fields, spacing)? } else { DAffine3::from_scale(spacing) }
    };
    Ok(DAffine3::from_scale(DVec3::splat(millimetres(fields)?)) * in_units)
}

/// Millimetres in the header's unit of length. The lowest three bits hold this unit, beside the unit of time.
fn millimetres(fields: &Fields) -> Result<f64, VolumeError> {
    match fields.xyzt_units & 7 {
        // 0 is unknown, which readers take for millimetres.
        0 | 2 => Ok(1.0),
        1 => Ok(1e3),
        3 => Ok(1e-3),
        code => Err(VolumeError::field("xyzt_units", code, "not a known unit of length")),
    }
}

/// The spacings, in the header's unit. Some programs write them negative; the sign has no meaning.
fn spacing(fields: &Fields) -> Result<DVec3, VolumeError> {
    let [_, x, y, z, ..] = fields.pixdim.map(f64::abs);
    let spacing = DVec3::new(x, y, z);
    if spacing.is_finite() && spacing.cmpgt(DVec3::ZERO).all() {
        return Ok(spacing);
    }
    Err(VolumeError::field("pixdim", format!("{x} {y} {z}"), "spacings must be finite and not zero"))
}

/// The transform by the header's quaternion, with the third axis reversed if `pixdim[0]` is negative.
fn qform(fields: &Fields, spacing: DVec3) -> Result<DAffine3, VolumeError> {
    let [b, c, d] = fields.quatern;
    let square = b * b + c * c + d * d;
    // Three rounded floats may be a little longer than one; the standard normalises them.
    if square.is_nan() || square > 1.01 {
        return Err(VolumeError::field("quatern", format!("{b} {c} {d}"), "not part of a unit quaternion"));
    }
    let a = (1.0 - square).max(0.0).sqrt();
    let rotation = DMat3::from_quat(DQuat::from_xyzw(b, c, d, a).normalize());
    let third = if fields.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
    Ok(DAffine3::from_mat3_translation(
        rotation * DMat3::from_diagonal(spacing * DVec3::new(1.0, 1.0, third)),
        DVec3::from_array(fields.qoffset),
    ))
}
