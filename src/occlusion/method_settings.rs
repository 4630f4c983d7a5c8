//! Properties of an occlusion method that other modules read from its settings, before any of its passes runs.

use bevy::{math::DMat3, prelude::*};
use core::{any::Any, fmt::Debug};

use super::{OcclusionTexels, Sky, lengths::length_mm};
use crate::volume::VolumeGeometry;

/// Settings of an occlusion method.
///
/// [`OcclusionMethod::custom`](super::OcclusionMethod::custom) takes the settings of a method from outside of this
/// crate; `docs/adding_a_method.md` shows such a method.
pub trait MethodSettings: Any + Debug + Send + Sync {
    /// The method's name on command lines and in tables. No two methods have the same.
    fn name(&self) -> &'static str;

    /// Kind of the method: what it computes, and when. Methods from outside of this crate run only as
    /// [`MethodKind::AllVoxels`].
    fn kind(&self) -> MethodKind {
        MethodKind::AllVoxels
    }

    /// Memory that the method takes for a volume of these dimensions (voxels), beside the occlusion texture.
    fn bytes(&self, dimensions: UVec3) -> MethodBytes {
        let _ = dimensions;
        default()
    }

    /// How the method's result is drawn.
    fn drawing(&self) -> MethodDrawing {
        default()
    }

    /// Factor of an open flat surface under a sky, 0 to 1; by default 1. Drawing may divide by it ([`AmbientScale`](super::AmbientScale)).
    fn flat_factor(&self, sky: &Sky, geometry: &VolumeGeometry) -> f64 {
        let _ = (sky, geometry);
        1.0
    }

    /// Axes (columns, volume space) of octants of which octant 7 alone brings light, for [`OcclusionTexels::Octants`].
    /// By default there are none: octants follow the axes of the grid, and the sky weights them.
    fn light_axes(&self, geometry: &VolumeGeometry) -> Option<DMat3> {
        let _ = geometry;
        None
    }

    /// Length, mm, of the path whose opacity counts as a voxel's where the method reads opacities. By default the
    /// smallest voxel spacing.
    fn step_length_mm(&self, geometry: &VolumeGeometry) -> f64 {
        length_mm(None, 1.0, geometry)
    }

    /// Farthest distance, mm, from a voxel's centre at which its occlusion factor takes samples. Only for
    /// [`MethodKind::StaleVoxels`]: the other kinds recompute everything.
    fn sampled_mm(&self, geometry: &VolumeGeometry) -> f64 {
        let _ = geometry;
        0.0
    }
}

/// What a method computes, and when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MethodKind {
    /// An occlusion factor for every voxel that a view reads, where something within reach changed.
    StaleVoxels,
    /// An occlusion factor for every voxel, after every change.
    AllVoxels,
    /// The occlusion of the surfaces in a view, after the view has been drawn, in every frame.
    DrawnViews,
    /// The image of a volume in a view, in place of slices along view rays, in every frame.
    DrawingViews,
}

impl MethodKind {
    /// Whether a factor is kept for every voxel, for all views. Otherwise each view computes its own occlusion.
    pub fn is_of_voxels(self) -> bool {
        matches!(self, Self::StaleVoxels | Self::AllVoxels)
    }
}

/// Memory that a method takes on the GPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MethodBytes {
    /// Size of all buffers and textures.
    pub total: u64,
    /// Size of the largest buffer.
    pub largest_buffer: u64,
}

impl MethodBytes {
    /// Memory of buffers of these sizes.
    pub fn of_buffers(sizes: &[u64]) -> Self {
        Self { total: sizes.iter().sum(), largest_buffer: sizes.iter().copied().max().unwrap_or(0) }
    }
}

/// How the result of a method is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MethodDrawing {
    /// Content of the occlusion texture.
    pub texels: OcclusionTexels,
    /// Whether only a surface is drawn, by the distance field that the method keeps.
    pub draws_surface: bool,
    /// Exponent of the light that reaches a point, for [`OcclusionTexels::Octants`].
    pub power: f32,
    /// Whether both sides of a surface get light, for [`OcclusionTexels::Octants`].
    pub both_sides: bool,
}

impl Default for MethodDrawing {
    fn default() -> Self {
        Self { texels: OcclusionTexels::Factors, draws_surface: false, power: 1.0, both_sides: false }
    }
}
