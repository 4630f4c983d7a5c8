//! The component that says how ambient occlusion is computed.

use bevy::{math::DVec3, prelude::*};

use super::{OcclusionMethod, OcclusionTexels, Sky};
use crate::volume::VolumeGeometry;

/// How the ambient occlusion of a volume is computed (required by
/// [`Volume3d`](crate::volume::Volume3d)).
///
/// A change recomputes all visible occlusion in the same frame. Progressive rays alone take several frames.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct AmbientOcclusion {
    /// The method, with its settings.
    pub method: OcclusionMethod,
    /// Light from each octant of directions. Rays and sweeping use it, the other methods ignore it.
    pub sky: Sky,
    /// Opacity of a voxel, as occlusion sees it.
    pub opacities: VoxelOpacities,
    /// Occlusion that is recomputed in a frame. The image is the same either way.
    pub recompute: Recompute,
}

/// Opacity of a voxel, as occlusion sees it.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum VoxelOpacities {
    /// That of the voxel's own intensity, as published. Steep transfer functions make it 0 or 1, and occlusion shows
    /// the voxels as steps.
    OfCenters,
    /// The mean of the transfer function over the intensities in the voxel. Steep transfer functions give smooth
    /// occlusion. Clipping a voxel reads its 6 neighbours as well.
    #[default]
    Means,
}

/// Occlusion that is recomputed in a frame.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum Recompute {
    /// Occlusion that a change can have affected. With rays this is contextual ambient occlusion (CAO).
    #[default]
    Changed,
    /// All occlusion, in every frame. With rays this is local ambient occlusion (LAO), the reference for CAO. It is one
    /// dispatch: for large volumes and many rays a driver's watchdog may end it.
    Everything,
}

impl AmbientOcclusion {
    /// Occlusion by a method, with defaults for the rest. Settings of a method stand for the method.
    pub fn by(method: impl Into<OcclusionMethod>) -> Self {
        Self { method: method.into(), ..default() }
    }

    /// Limits these settings to their valid ranges.
    pub(crate) fn clamped(&self) -> Self {
        Self { method: self.method.clamped(), sky: Sky(self.sky.normalized()), ..*self }
    }

    /// Content of the occlusion texture.
    pub(crate) fn texels(&self) -> OcclusionTexels {
        self.method.settings().drawing().texels
    }

    /// Occlusion factor of an open flat surface under the sky, 0.05 to 1.
    pub fn flat_factor(&self, geometry: &VolumeGeometry) -> f64 {
        self.method.settings().flat_factor(&self.sky, geometry).clamp(0.05, 1.0)
    }

    /// Weights of the octants of the grid, or of those of a single light, with a mean of 1.
    pub(crate) fn octant_weights(&self, geometry: &VolumeGeometry) -> [f32; 8] {
        match self.method.settings().light_axes(geometry) {
            Some(_) => Sky::octant(7).normalized(),
            None => self.sky.of_grid(geometry),
        }
    }

    /// Length, mm, of the path whose opacity counts as a voxel's.
    pub fn step_length_mm(&self, geometry: &VolumeGeometry) -> f64 {
        self.method.settings().step_length_mm(geometry)
    }

    /// The reach, mm: the farthest distance at which clipping can change a voxel's occlusion.
    ///
    /// It is the distance of the farthest sample, its trilinear footprint (one voxel diagonal) and the coverage
    /// footprint. Methods that recompute everything have no samples: their reach is how far clipping changes opacities.
    pub fn reach_mm(&self, geometry: &VolumeGeometry) -> f64 {
        let sampled_mm = self.method.settings().sampled_mm(geometry);
        sampled_mm + geometry.cell_diagonal_mm() + self.footprint_mm(geometry)
    }

    /// Radius, mm, around a voxel of all points whose clipping decides its coverage, and all that read the voxel by a
    /// trilinear look-up.
    ///
    /// The published points reach 1.025 voxel diagonals (supplementary notes to the paper's algorithm 2). The lines
    /// reach 1.095 voxels in two directions and 1 in the third, whichever way the clip camera looks. Where 2x2x2 voxels
    /// share a factor, points up to two voxels from their middle read the factor. The middle is half a voxel from the
    /// voxel that stands for the eight.
    pub fn footprint_mm(&self, geometry: &VolumeGeometry) -> f64 {
        let lines = DVec3::new(1.095, 1.095, 1.0).length() * geometry.longest_stretch_mm();
        let blocks = 1.5 * f64::from(self.texels().stride() - 1) * geometry.cell_diagonal_mm();
        lines.max(1.025 * geometry.cell_diagonal_mm()) + blocks
    }
}
