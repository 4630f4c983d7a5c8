//! The component that says how ambient occlusion is computed.

use bevy::{math::DVec3, prelude::*};

use super::{
    MethodKind, OcclusionMethod, OcclusionTexels, RayDirection, RayPattern, Sky,
    lengths::{length_mm, within},
};
use crate::volume::VolumeGeometry;

/// How the ambient occlusion of a volume is computed (required by
/// [`Volume3d`](crate::volume::Volume3d)).
///
/// A change recomputes the occlusion of all voxels that are seen, in the same frame.
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct AmbientOcclusion {
    /// By which method, with the settings that it has for itself.
    pub method: OcclusionMethod,
    /// Of methods that cast rays: the directions in which a voxel looks. More rays cost proportionally more
    /// time and lower the error; few rays show as bands in smooth regions.
    pub pattern: RayPattern,
    /// Of methods that cast rays: samples per ray. More reach farther and cost proportionally more time per
    /// recomputed voxel; a carver then also makes more voxels recompute. At most [`Self::MAX_STEPS`].
    pub steps: u32,
    /// Distance between samples, millimetres; `None` is one voxel, the smallest spacing. Longer steps reach
    /// farther for the same cost and may step over structures thinner than themselves. At most
    /// [`Self::MAX_STEP_MM`].
    pub step_mm: Option<f32>,
    /// Of methods that cast rays: for how many voxels.
    pub resolution: OcclusionResolution,
    /// Of methods that cast rays, and of sweeping: where the light comes from.
    pub sky: Sky,
    /// What is computed anew in a frame. The image is the same.
    pub recompute: Recompute,
}

impl Default for AmbientOcclusion {
    fn default() -> Self {
        Self {
            method: OcclusionMethod::default(),
            pattern: RayPattern::default(),
            steps: 20,
            step_mm: None,
            resolution: OcclusionResolution::default(),
            sky: Sky::default(),
            recompute: Recompute::default(),
        }
    }
}

/// What occlusion is computed anew in a frame.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum Recompute {
    /// What a change can have affected: contextual ambient occlusion (CAO), where rays are cast.
    #[default]
    Changed,
    /// All of it, in every frame: local ambient occlusion (LAO), where rays are cast, the reference for CAO. It is one
    /// dispatch: for large volumes and many rays a driver's watchdog may end it.
    Everything,
}

/// For how many voxels occlusion is computed.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum OcclusionResolution {
    /// For each.
    #[default]
    Full,
    /// For every other along each axis, at the middle of 2x2x2: an eighth of the memory, up to an eighth of
    /// the rays, and blurred.
    Half,
}

impl OcclusionResolution {
    /// Voxels along each side of what has one occlusion factor.
    pub(crate) fn stride(self) -> u32 {
        match self {
            Self::Full => 1,
            Self::Half => 2,
        }
    }
}

impl AmbientOcclusion {
    /// The most samples per ray; more are not taken.
    pub const MAX_STEPS: u32 = 4096;
    /// The longest distance between samples, mm.
    pub const MAX_STEP_MM: f32 = 1000.0;

    /// These settings within what can be computed.
    pub(crate) fn clamped(&self) -> Self {
        Self {
            method: self.method.clamped(),
            sky: Sky(self.sky.normalized()),
            steps: self.steps.min(Self::MAX_STEPS),
            step_mm: self.step_mm.map(|mm| within(mm, Self::MAX_STEP_MM)),
            // Only rays leave out voxels.
            resolution: if self.leaves_out_voxels() { self.resolution } else { default() },
            ..self.clone()
        }
    }

    /// Whether the occlusion of some voxels stays when that of others is recomputed.
    fn leaves_out_voxels(&self) -> bool {
        self.method.kind() == MethodKind::StaleVoxels
    }

    /// What the occlusion texture holds.
    pub(crate) fn texels(&self) -> OcclusionTexels {
        match self.method.settings().drawing().texels {
            OcclusionTexels::Factors if self.clamped().resolution == OcclusionResolution::Half => {
                OcclusionTexels::HalfFactors
            }
            texels => texels,
        }
    }

    /// Distance between samples, mm: the one that is set, or a voxel.
    pub fn step_length_mm(&self, geometry: &VolumeGeometry) -> f64 {
        length_mm(self.step_mm, 1.0, geometry)
    }

    /// The rays of every voxel, volume space, those that bring no light left out.
    pub fn rays(&self, geometry: &VolumeGeometry) -> Vec<RayDirection> {
        let axes = geometry.local_from_voxel.matrix3.inverse();
        let weighted = self.pattern.directions().into_iter().map(|ray| {
            // Octants are those of the grid's axes, whose scale does not count.
            let weight = ray.weight * self.sky.weight(axes * ray.direction);
            RayDirection { weight, ..ray }
        });
        let rays: Vec<_> = weighted.filter(|ray| ray.weight > 0.0).collect();
        let sum: f64 = rays.iter().map(|ray| ray.weight).sum();
        if self.sky == Sky::default() || rays.is_empty() {
            // Of very few rays none may be in the octants chosen.
            return self.pattern.directions();
        }
        rays.into_iter().map(|ray| RayDirection { weight: ray.weight / sum, ..ray }).collect()
    }

    /// Distance of the first sample from the voxel centre, mm: one voxel diagonal.
    pub fn start_mm(spacing_mm: DVec3) -> f64 {
        spacing_mm.length()
    }

    /// The farthest distance, mm, at which clipping can change a voxel's occlusion: the farthest
    /// sample, its trilinear footprint (one voxel diagonal) and the coverage footprint. Methods that cast no
    /// rays recompute everything: it is how far clipping changes opacities.
    pub fn reach_mm(&self, geometry: &VolumeGeometry) -> f64 {
        let ray = if self.steps == 0 || !self.leaves_out_voxels() {
            0.0
        } else {
            Self::start_mm(geometry.spacing_mm) + (self.steps - 1) as f64 * self.step_length_mm(geometry)
        };
        ray + geometry.cell_diagonal_mm() + self.footprint_mm(geometry)
    }

    /// Distance, mm, within which lie all points whose clipping decides a voxel's coverage, and all
    /// that read the voxel: 1.025 voxel diagonals for the published points (supplementary notes to
    /// the paper's algorithm 2); the lines reach 1.095 voxels in two directions and 1 in the third,
    /// whichever way the clip camera looks. Where 2x2x2 voxels have one factor, points two voxels from their
    /// middle read it, which is half a voxel from the one that stands for them.
    pub fn footprint_mm(&self, geometry: &VolumeGeometry) -> f64 {
        let lines = DVec3::new(1.095, 1.095, 1.0).length() * geometry.longest_stretch_mm();
        let blocks = 1.5 * f64::from(self.resolution.stride() - 1) * geometry.cell_diagonal_mm();
        lines.max(1.025 * geometry.cell_diagonal_mm()) + blocks
    }
}
