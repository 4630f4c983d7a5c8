//! The settings of local ambient occlusion: rays around every voxel (equations 2 and 3 of the CAO paper).

use bevy::{math::DVec3, prelude::*};

use super::{
    MethodDrawing, MethodKind, MethodSettings, OcclusionTexels, RayDirection, RayPattern, Sky,
    flat_surface::flat_factor,
    lengths::{length_mm, within},
};
use crate::volume::VolumeGeometry;

/// Rays around every voxel: local ambient occlusion.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct OcclusionRays {
    /// Directions of a voxel's rays. More rays cost proportionally more time and lower the error. Few rays show as
    /// bands in smooth regions.
    pub pattern: RayPattern,
    /// Samples per ray. More samples reach farther and cost proportionally more time per recomputed voxel. A carver
    /// then also affects more voxels. At most [`Self::MAX_STEPS`].
    pub steps: u32,
    /// Distance between samples, millimetres; `None` is one voxel, the smallest spacing. Longer steps reach
    /// farther for the same cost. They may step over structures thinner than the step. At most
    /// [`Self::MAX_STEP_MM`].
    pub step_mm: Option<f32>,
    /// Share of the voxels that cast rays.
    pub resolution: OcclusionResolution,
}

impl Default for OcclusionRays {
    fn default() -> Self {
        Self { pattern: default(), steps: 20, step_mm: None, resolution: default() }
    }
}

/// Share of the voxels that cast rays.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum OcclusionResolution {
    /// Every voxel casts rays.
    #[default]
    Full,
    /// Every 2x2x2 voxels cast rays from their middle. This takes an eighth of the memory and as little as an eighth of
    /// the rays, and blurs.
    Half,
}

impl OcclusionRays {
    /// Span of the pass that marks the stale voxels that views will read, in the diagnostics.
    pub const SPAN_MARK: &str = "contextual_ao/mark";
    /// Span of the pass that casts the rays of stale voxels (step V), in the diagnostics.
    pub const SPAN_CAST: &str = "contextual_ao/ray_cast";
    /// Largest number of samples per ray; more are not taken.
    pub const MAX_STEPS: u32 = 4096;
    /// Longest distance between samples, mm.
    pub const MAX_STEP_MM: f32 = 1000.0;

    /// Limits these settings to their valid ranges.
    pub(super) fn clamped(self) -> Self {
        Self {
            steps: self.steps.min(Self::MAX_STEPS),
            step_mm: self.step_mm.map(|mm| within(mm, Self::MAX_STEP_MM)),
            ..self
        }
    }

    /// The rays of every voxel under a sky, volume space, without the rays that bring no light.
    pub fn directions(&self, sky: &Sky) -> Vec<RayDirection> {
        let all = self.pattern.directions();
        let weighted =
            all.iter().map(|ray| RayDirection { weight: ray.weight * sky.weight(ray.direction), ..*ray });
        let rays: Vec<_> = weighted.filter(|ray| ray.weight > 0.0).collect();
        let sum: f64 = rays.iter().map(|ray| ray.weight).sum();
        if *sky == Sky::default() || rays.is_empty() {
            // A pattern of very few rays may have none in the chosen octants.
            return all;
        }
        rays.into_iter().map(|ray| RayDirection { weight: ray.weight / sum, ..ray }).collect()
    }

    /// Distance of the first sample from the voxel centre, mm: one voxel diagonal.
    pub fn start_mm(spacing_mm: DVec3) -> f64 {
        spacing_mm.length()
    }
}

impl MethodSettings for OcclusionRays {
    fn name(&self) -> &'static str {
        "rays"
    }

    fn kind(&self) -> MethodKind {
        MethodKind::StaleVoxels
    }

    fn drawing(&self) -> MethodDrawing {
        let texels = match self.resolution {
            OcclusionResolution::Full => OcclusionTexels::Factors,
            OcclusionResolution::Half => OcclusionTexels::HalfFactors,
        };
        MethodDrawing { texels, ..default() }
    }

    fn flat_factor(&self, sky: &Sky, geometry: &VolumeGeometry) -> f64 {
        let voxel_mm = geometry.spacing_mm.min_element();
        let start = Self::start_mm(geometry.spacing_mm) / voxel_mm;
        flat_factor(self.steps, start, self.step_length_mm(geometry) / voxel_mm, sky)
    }

    /// Distance between samples, mm: the one set, or a voxel.
    fn step_length_mm(&self, geometry: &VolumeGeometry) -> f64 {
        length_mm(self.step_mm, 1.0, geometry)
    }

    /// The distance of the farthest sample.
    fn sampled_mm(&self, geometry: &VolumeGeometry) -> f64 {
        match self.steps {
            0 => 0.0,
            steps => {
                Self::start_mm(geometry.spacing_mm) + f64::from(steps - 1) * self.step_length_mm(geometry)
            }
        }
    }
}
