//! The component that says how a volume is drawn.

use bevy::prelude::*;

/// How a volume is drawn (required by [`Volume3d`](crate::volume::Volume3d)).
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct VolumeShading {
    /// The light on samples.
    pub lighting: VolumeLighting,
    /// Whether [`AmbientOcclusion`](super::AmbientOcclusion) darkens samples: the ambient and diffuse parts of lit
    /// samples, all of the colour of unlit ones. If `false`, no occlusion is computed.
    pub ambient_occlusion: bool,
    /// Distance between samples along a view ray, in units of the smallest voxel spacing. Smaller
    /// steps cost proportionally more drawing time and show fewer slices.
    pub step_voxels: f32,
    /// Interpolation of intensities between voxels.
    pub reconstruction: Reconstruction,
    /// Moves the start of every view ray by a fixed pattern, which turns slices into noise.
    pub jitter: bool,
}

impl Default for VolumeShading {
    fn default() -> Self {
        Self {
            lighting: default(),
            ambient_occlusion: true,
            step_voxels: 0.5,
            reconstruction: default(),
            jitter: true,
        }
    }
}

impl VolumeShading {
    /// Distance between samples, voxels, within its valid range.
    pub(crate) fn drawn_step_voxels(&self) -> f32 {
        self.step_voxels.max(0.01)
    }
}

/// The light on the samples of a volume.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum VolumeLighting {
    /// No light: samples show the transfer function's colour.
    #[default]
    Unlit,
    /// A light at the camera, by Blinn-Phong. Normals come from the clipped opacities, or from the distance field
    /// where only an isosurface is drawn.
    Headlight,
}

/// Interpolation of intensities between voxels, for the pictures of volumes. Occlusion is the same by both.
///
/// Screen-space and direct occlusion draw by trilinear intensities alone.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum Reconstruction {
    /// By the nearest 8 voxels. One filtered sample a place: fast. Surfaces and boundaries of tissues have kinks at
    /// voxels, which show as steps and grain.
    Trilinear,
    /// By the nearest 64 voxels, with a cubic B-spline. Eight filtered samples a place. Surfaces and boundaries are
    /// smooth. Details finer than two voxels, and noise, lose contrast.
    #[default]
    Tricubic,
}

impl Reconstruction {
    /// Shader definition of the passes that follow or draw view rays.
    pub(crate) fn shader_def(self) -> Option<&'static str> {
        match self {
            Self::Trilinear => None,
            Self::Tricubic => Some("TRICUBIC"),
        }
    }
}
