//! The settings of progressive local ambient occlusion (Hernell et al. 2007, as described in the CAO paper).

use bevy::prelude::*;

use super::{MethodBytes, MethodDrawing, MethodKind, MethodSettings, OcclusionRays, Sky};
use crate::volume::VolumeGeometry;

/// Local ambient occlusion that casts some of its rays in every frame. After a change it takes several frames until
/// all rays of the pattern have been cast. Until then the image is noisy, or old.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct ProgressiveRays {
    /// All rays, which are cast over several frames.
    pub rays: OcclusionRays,
    /// Rays of every voxel in a frame, at least 1. More rays cost proportionally more time and lag fewer frames.
    pub rays_per_frame: u32,
    /// Weight of the old occlusion after a change, from 0 to 0.99. 0 starts anew, which flickers. A higher weight is
    /// steadier, and the old image stays visible for longer.
    pub kept_on_change: f32,
}

impl ProgressiveRays {
    /// Limits these settings to their valid ranges.
    pub(super) fn clamped(self) -> Self {
        let kept = if self.kept_on_change.is_finite() { self.kept_on_change } else { 0.0 };
        Self {
            rays: self.rays.clamped(),
            rays_per_frame: self.rays_per_frame.max(1),
            kept_on_change: kept.clamp(0.0, 0.99),
        }
    }
}

impl Default for ProgressiveRays {
    fn default() -> Self {
        Self { rays: default(), rays_per_frame: 1, kept_on_change: 0.0 }
    }
}

impl MethodSettings for ProgressiveRays {
    fn name(&self) -> &'static str {
        "progressive"
    }

    fn kind(&self) -> MethodKind {
        self.rays.kind()
    }

    /// Memory of a sum for every voxel.
    fn bytes(&self, dimensions: UVec3) -> MethodBytes {
        MethodBytes::of_buffers(&[4 * dimensions.as_u64vec3().element_product()])
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
