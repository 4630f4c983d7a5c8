//! The component that says how a volume is drawn.

use bevy::prelude::*;

/// How a volume is drawn (required by [`Volume3d`](crate::volume::Volume3d)).
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct VolumeShading {
    /// What lights samples.
    pub lighting: VolumeLighting,
    /// Whether samples are darkened by [`AmbientOcclusion`](super::AmbientOcclusion): the ambient and diffuse parts
    /// where they are lit, else all of the colour. Without it none is computed.
    pub ambient_occlusion: bool,
    /// Distance between samples along a view ray, in units of the smallest voxel spacing. Smaller
    /// steps cost proportionally more drawing time and show fewer slices.
    pub step_voxels: f32,
    /// Moves the start of every view ray by a fixed pattern, which turns slices into noise.
    pub jitter: bool,
}

impl Default for VolumeShading {
    fn default() -> Self {
        Self { lighting: default(), ambient_occlusion: true, step_voxels: 0.5, jitter: true }
    }
}

/// What lights the samples of a volume.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum VolumeLighting {
    /// Nothing: the transfer function's colour is shown.
    #[default]
    Unlit,
    /// A light at the camera, by Blinn-Phong. Normals are those of the clipped opacities, or of the distance field
    /// where an isosurface is drawn alone.
    Headlight,
}
