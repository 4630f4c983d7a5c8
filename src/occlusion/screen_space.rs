//! The settings of screen-space ambient occlusion for volumes (Kitware 2023, VTK's `vtkSSAOPass`).

use bevy::prelude::*;

/// Each view finds the first point along each of its rays where opacity exceeds a threshold, and around it
/// the points that lie behind what the view sees there. Opaque meshes of the scene and volumes occlude each
/// other. Costs the same for every frame, whether anything changed or not; knows nothing of what is hidden or
/// outside of the image.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct ScreenSpaceOcclusion {
    /// Opacity, of a drawing step, from which on a sample is taken for the surface. Lower ones find surfaces
    /// that are hardly seen; where no sample reaches it there is no occlusion.
    pub opacity_threshold: f32,
    /// How far away is looked for what occludes, mm of the volume. Longer ones darken larger hollows, and
    /// whatever stands in front of something.
    pub radius_mm: f32,
    /// How far something must be in front of a point to occlude it, mm. Less shows the steps of voxels, more
    /// loses creases.
    pub bias_mm: f32,
    /// Points looked at around each pixel, at most [`Self::MOST_SAMPLES`]. More cost proportionally more time
    /// and show less noise.
    pub samples: u32,
    /// Whether the noise is blurred, over 4 x 4 pixels.
    pub blur: bool,
}

impl ScreenSpaceOcclusion {
    /// The most points around a pixel.
    pub const MOST_SAMPLES: u32 = 256;
}

impl Default for ScreenSpaceOcclusion {
    fn default() -> Self {
        Self { opacity_threshold: 0.5, radius_mm: 20.0, bias_mm: 0.5, samples: 32, blur: true }
    }
}
