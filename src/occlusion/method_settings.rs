//! What is known of an occlusion method before any of its passes runs: all that other rooms ask of its settings.

use bevy::prelude::*;
use core::{any::Any, fmt::Debug};

use super::{OcclusionTexels, lengths::length_mm};
use crate::volume::VolumeGeometry;

/// Settings of an occlusion method.
///
/// [`OcclusionMethod::custom`](super::OcclusionMethod::custom) takes those of a method from outside of this crate;
/// `docs/adding_a_method.md` shows one.
pub trait MethodSettings: Any + Debug + Send + Sync {
    /// The method's name on command lines and in tables. No two methods have the same.
    fn name(&self) -> &'static str;

    /// What is computed, and when. Of methods from outside of this crate only [`MethodKind::AllVoxels`] is computed.
    fn kind(&self) -> MethodKind {
        MethodKind::AllVoxels
    }

    /// What the method keeps for a volume of so many voxels, beside the occlusion texture.
    fn bytes(&self, dimensions: UVec3) -> MethodBytes {
        let _ = dimensions;
        default()
    }

    /// What drawing has to know of it.
    fn drawing(&self) -> MethodDrawing {
        default()
    }

    /// The way, mm, whose opacity stands for a voxel's where the method reads it; a voxel of the smallest spacing.
    fn step_length_mm(&self, geometry: &VolumeGeometry) -> f64 {
        length_mm(None, 1.0, geometry)
    }

    /// How far from a voxel's middle, mm, its factor samples others. Of [`MethodKind::StaleVoxels`] alone: the others
    /// compute all voxels.
    fn sampled_mm(&self, geometry: &VolumeGeometry) -> f64 {
        let _ = geometry;
        0.0
    }
}

/// What a method computes, and when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MethodKind {
    /// A factor for every voxel that a view reads, where something within reach changed.
    StaleVoxels,
    /// A factor for every voxel, after every change.
    AllVoxels,
    /// What a view shows, after it has been drawn, in every frame.
    DrawnViews,
    /// The image of a volume in a view, in place of the material's, in every frame.
    DrawingViews,
}

impl MethodKind {
    /// Whether a factor is kept for every voxel, whoever looks at it. Otherwise views compute their own.
    pub fn is_of_voxels(self) -> bool {
        matches!(self, Self::StaleVoxels | Self::AllVoxels)
    }
}

/// Memory that a method takes on the GPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MethodBytes {
    /// Of all buffers and textures.
    pub total: u64,
    /// Of the largest buffer.
    pub largest_buffer: u64,
}

impl MethodBytes {
    /// Of buffers of these sizes.
    pub fn of_buffers(sizes: &[u64]) -> Self {
        Self { total: sizes.iter().sum(), largest_buffer: sizes.iter().copied().max().unwrap_or(0) }
    }
}

/// How what a method computed is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MethodDrawing {
    /// What the occlusion texture holds.
    pub texels: OcclusionTexels,
    /// Whether a surface is drawn alone, by the distance field that the method keeps.
    pub draws_surface: bool,
    /// Of [`OcclusionTexels::Octants`]: the light that comes to a point is raised to this power.
    pub power: f32,
    /// Of [`OcclusionTexels::Octants`]: whether both sides of a surface get light.
    pub both_sides: bool,
}

impl Default for MethodDrawing {
    fn default() -> Self {
        Self { texels: OcclusionTexels::Factors, draws_surface: false, power: 1.0, both_sides: false }
    }
}
