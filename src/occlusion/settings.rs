//! The component that says how ambient occlusion is computed.

use bevy::{math::DVec3, prelude::*};

use super::{OcclusionMethod, OcclusionTexels, Sky};
use crate::volume::VolumeGeometry;

/// How the ambient occlusion of a volume is computed (required by
/// [`Volume3d`](crate::volume::Volume3d)).
///
/// A change recomputes the occlusion of all voxels that are seen, in the same frame.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct AmbientOcclusion {
    /// By which method, with its settings.
    pub method: OcclusionMethod,
    /// Where the light comes from. Rays and sweeping know it; light comes to the others from all sides.
    pub sky: Sky,
    /// What is computed anew in a frame. The image is the same.
    pub recompute: Recompute,
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

impl AmbientOcclusion {
    /// By a method, the rest as it is by default. Settings of a method stand for it.
    pub fn by(method: impl Into<OcclusionMethod>) -> Self {
        Self { method: method.into(), ..default() }
    }

    /// These settings within what can be computed.
    pub(crate) fn clamped(&self) -> Self {
        Self { method: self.method.clamped(), sky: Sky(self.sky.normalized()), ..*self }
    }

    /// What the occlusion texture holds.
    pub(crate) fn texels(&self) -> OcclusionTexels {
        self.method.settings().drawing().texels
    }

    /// The way, mm, whose opacity stands for a voxel's.
    pub fn step_length_mm(&self, geometry: &VolumeGeometry) -> f64 {
        self.method.settings().step_length_mm(geometry)
    }

    /// The farthest distance, mm, at which clipping can change a voxel's occlusion: the farthest
    /// sample, its trilinear footprint (one voxel diagonal) and the coverage footprint. Methods that
    /// recompute everything have no samples: it is how far clipping changes opacities.
    pub fn reach_mm(&self, geometry: &VolumeGeometry) -> f64 {
        let sampled_mm = self.method.settings().sampled_mm(geometry);
        sampled_mm + geometry.cell_diagonal_mm() + self.footprint_mm(geometry)
    }

    /// Distance, mm, within which lie all points whose clipping decides a voxel's coverage, and all
    /// that read the voxel: 1.025 voxel diagonals for the published points (supplementary notes to
    /// the paper's algorithm 2); the lines reach 1.095 voxels in two directions and 1 in the third,
    /// whichever way the clip camera looks. Where 2x2x2 voxels have one factor, points two voxels from their
    /// middle read it, which is half a voxel from the one that stands for them.
    pub fn footprint_mm(&self, geometry: &VolumeGeometry) -> f64 {
        let lines = DVec3::new(1.095, 1.095, 1.0).length() * geometry.longest_stretch_mm();
        let blocks = 1.5 * f64::from(self.texels().stride() - 1) * geometry.cell_diagonal_mm();
        lines.max(1.025 * geometry.cell_diagonal_mm()) + blocks
    }
}
