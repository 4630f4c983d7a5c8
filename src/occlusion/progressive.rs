//! The settings of progressive local ambient occlusion (Hernell et al. 2007 and 2010, as described in the CAO paper).

use bevy::prelude::*;

use super::{MethodBytes, MethodDrawing, MethodKind, MethodSettings, OcclusionRays, Sky};
use crate::volume::VolumeGeometry;

/// Local ambient occlusion that casts some of its rays in every frame, around voxels that a change touched.
///
/// Rays cycle through the pattern, and a voxel's factor is a running mean of the last ones. While something moves, the
/// image is noisy and lags. At rest it settles to that of all rays, exactly, once each has been cast.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct ProgressiveRays {
    /// All rays, which are cast over several frames.
    pub rays: OcclusionRays,
    /// Rays of every voxel in a frame, at least 1. More rays cost proportionally more time and lag fewer frames.
    pub rays_per_frame: u32,
    /// Most weight of the earlier rays after a change, 0 to 1; 1 is that of the whole pattern. 0 starts anew, which
    /// flickers. A higher weight is steadier while something moves, and lags more.
    pub kept_on_change: f32,
}

impl ProgressiveRays {
    /// Limits these settings to their valid ranges.
    pub(super) fn clamped(self) -> Self {
        let kept = if self.kept_on_change.is_finite() { self.kept_on_change } else { 0.0 };
        Self {
            rays: self.rays.clamped(),
            rays_per_frame: self.rays_per_frame.max(1),
            kept_on_change: kept.clamp(0.0, 1.0),
        }
    }
}

impl Default for ProgressiveRays {
    fn default() -> Self {
        Self { rays: default(), rays_per_frame: 1, kept_on_change: 1.0 }
    }
}

impl MethodSettings for ProgressiveRays {
    fn name(&self) -> &'static str {
        "progressive"
    }

    fn kind(&self) -> MethodKind {
        self.rays.kind()
    }

    /// A buffer of a running mean for every voxel, and of a progress for every block of 4x4x2 voxels.
    fn bytes(&self, dimensions: UVec3) -> MethodBytes {
        let blocks = 2 * dimensions.map(|voxels| voxels.div_ceil(4)).as_u64vec3().element_product();
        MethodBytes::of_buffers(&[4 * dimensions.as_u64vec3().element_product() + 16 * blocks])
    }

    fn drawing(&self) -> MethodDrawing {
        self.rays.drawing()
    }

    fn flat_factor(&self, sky: &Sky, geometry: &VolumeGeometry) -> f64 {
        self.rays.flat_factor(sky, geometry)
    }

    fn step_length_mm(&self, geometry: &VolumeGeometry) -> f64 {
        self.rays.step_length_mm(geometry)
    }

    fn sampled_mm(&self, geometry: &VolumeGeometry) -> f64 {
        self.rays.sampled_mm(geometry)
    }
}
