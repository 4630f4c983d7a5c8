//! The settings of direct occlusion shading (Schott et al.: A Directional Occlusion Shading Model for
//! Interactive Direct Volume Rendering, 2009).

use bevy::prelude::*;

use super::{MethodKind, MethodSettings};

/// Each view sweeps through the volume, slice by slice away from the viewer, and blurs what light is left from
/// slice to slice: light from a cone around the viewer. Nothing is precomputed; every frame costs the same,
/// whether anything changed or not. Occlusion depends on where the viewer stands.
///
/// Each slice multiplies what light is left by the transmittance of what it meets, after the mean over the
/// base of a cone from slice to slice (section 3.4, equations 10 to 15). Only what is in the image occludes:
/// light comes in from beyond its edges. Opaque meshes hide volumes and do not shade them. Volumes with this
/// method are laid over each other by the distance of their centres, and under whatever else is translucent.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct DirectOcclusion {
    /// Angle between the cone's axis and its side, degrees, above 0 and below 90. Wider ones let more distant
    /// structures occlude and need more samples.
    pub aperture_degrees: f32,
    /// Samples along each side of the grid over the cone's base, at most [`Self::MAX_SAMPLES`]; their number
    /// grows with the square. Fewer show as a pattern.
    pub samples: u32,
    /// Distance between slices, in units of the smallest voxel spacing. Smaller ones cost proportionally more
    /// time; larger ones show as rings on opaque surfaces.
    pub slice_voxels: f32,
    /// Whether samples are attenuated along their own way through a slice (the paper's algorithm 2) instead
    /// of along its thickness (algorithm 3): slower, hardly different.
    pub exact_distance: bool,
}

impl DirectOcclusion {
    /// The most samples along each side of the grid.
    pub const MAX_SAMPLES: u32 = 16;
    /// The most slices of a volume; where there would be more they are farther apart.
    pub const MAX_SLICES: u32 = 4096;
    /// Shading and drawing the volumes of all views, in the diagnostics.
    pub const SPAN: &str = "contextual_ao/direct";

    /// These settings within what can be computed; the defaults where they are no numbers.
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

impl MethodSettings for DirectOcclusion {
    fn name(&self) -> &'static str {
        "direct"
    }

    fn kind(&self) -> MethodKind {
        MethodKind::DrawingViews
    }
}

impl Default for DirectOcclusion {
    fn default() -> Self {
        Self { aperture_degrees: 70.0, samples: 3, slice_voxels: 0.5, exact_distance: false }
    }
}
