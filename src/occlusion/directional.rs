//! The settings of directional occlusion shading (Schott et al.: A Directional Occlusion Shading Model for
//! Interactive Direct Volume Rendering, 2009).

use bevy::prelude::*;

use super::{MethodKind, MethodSettings};

/// Occlusion of light from a cone around the viewer.
///
/// Each view sweeps through the volume, slice by slice away from the viewer. The remaining light is blurred from
/// slice to slice. Nothing is precomputed: every frame costs the same, whether anything changed or not. Occlusion
/// depends on where the viewer stands.
///
/// Each slice takes the mean of the remaining light over the base of a cone from slice to slice. It multiplies the
/// mean by its own transmittance (section 3.4, equations 10 to 15). Only points in the image occlude: light comes in
/// from beyond the image's edges. Opaque meshes hide volumes and do not shade them. Volumes with this method are drawn
/// over each other by the distance of their centres, and under other translucent objects. Two eyes see different occlusion
/// ([`OcclusionDiffersBetweenEyes`](super::OcclusionDiffersBetweenEyes)).
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct DirectionalOcclusion {
    /// Angle between the cone's axis and its side, degrees, above 0 and below 90. Wider cones let more distant
    /// structures occlude and need more samples. The angle is that from one slice to a slice a voxel behind it. Means of
    /// means widen with the root of the distance: behind 20 voxels, 70 degrees act as 32. The distance of slices does not
    /// matter.
    pub aperture_degrees: f32,
    /// Samples along each side of the grid over the cone's base, at most [`Self::MAX_SAMPLES`]. The grid has the
    /// square of this number. Few samples show as a pattern.
    pub samples: u32,
    /// Distance between slices, in units of the smallest voxel spacing. Smaller distances cost proportionally more
    /// time, larger ones show as rings on opaque surfaces.
    pub slice_voxels: f32,
    /// Whether each sample is attenuated along its own path through a slice (the paper's algorithm 2), not along the
    /// slice's thickness (algorithm 3). It takes about as long, and darkens wide cones too much (`docs/measurements.md`).
    pub exact_distance: bool,
}

impl DirectionalOcclusion {
    /// Largest number of samples along each side of the grid.
    pub const MAX_SAMPLES: u32 = 16;
    /// Largest number of slices of a volume. A volume that needs more gets slices farther apart.
    pub const MAX_SLICES: u32 = 4096;
    /// Diagnostics span of the passes that shade and draw the volumes of all views.
    pub const SPAN: &str = "contextual_ao/directional";

    /// Limits these settings to their valid ranges, with the default in place of NaN.
    pub(crate) fn clamped(&self) -> Self {
        let default = Self::default();
        let number = |value: f32, default: f32| if value.is_nan() { default } else { value };
        Self {
            aperture_degrees: number(self.aperture_degrees, default.aperture_degrees).clamp(0.0, 89.0),
            samples: self.samples.clamp(1, Self::MAX_SAMPLES),
            slice_voxels: number(self.slice_voxels, default.slice_voxels).clamp(0.05, 100.0),
            ..*self
        }
    }
}

impl MethodSettings for DirectionalOcclusion {
    fn name(&self) -> &'static str {
        "directional"
    }

    fn kind(&self) -> MethodKind {
        MethodKind::DrawingViews
    }
}

impl Default for DirectionalOcclusion {
    fn default() -> Self {
        Self { aperture_degrees: 70.0, samples: 3, slice_voxels: 0.5, exact_distance: false }
    }
}
