//! Length settings.

use bevy::math::UVec3;

use crate::volume::VolumeGeometry;

/// Limits a length setting to 0 to `max`; 0 if it is not finite.
pub(super) fn within(value: f32, max: f32) -> f32 {
    if value.is_finite() { value.clamp(0.0, max) } else { 0.0 }
}

/// A length, mm: the one set, or `voxels` times the smallest spacing.
pub(super) fn length_mm(set_mm: Option<f32>, voxels: f64, geometry: &VolumeGeometry) -> f64 {
    set_mm.map_or(voxels * geometry.spacing_mm.min_element(), |mm| f64::from(mm).max(0.0))
}

/// A radius along each axis of the grid, whole voxels, 1 to `max`.
pub(super) fn whole_voxels(radius_mm: f64, max: u32, geometry: &VolumeGeometry) -> UVec3 {
    (radius_mm / geometry.spacing_mm).round().as_uvec3().clamp(UVec3::ONE, UVec3::splat(max))
}
