//! Quality presets: the rays of a voxel, their resolution, and the samples of view rays with their filter under one name.

use bevy::prelude::*;
use core::{fmt, str::FromStr};

use super::{
    AmbientOcclusion, OcclusionRays, OcclusionResolution, RayPattern, Reconstruction, VolumeShading,
};

/// A preset of the settings that trade time for accuracy.
///
/// | | rays | resolution | view samples, voxels | jitter | reconstruction | view rays at outlines |
/// | --- | --- | --- | --- | --- | --- | --- |
/// | `Low` | 14 | half | 1 | yes | trilinear | 1 |
/// | `Medium` | 36 | full | 0.5 | yes | smooth colours | 4 |
/// | `High` | 96 | full | 0.25 | yes | smooth occlusion | 8 |
/// | `Reference` | 512 | full | 0.125 | no | smooth occlusion | 32 |
///
/// All presets reach equally far: 20 samples a ray, a voxel apart. Fewer and longer steps of the same reach lose more
/// accuracy than they save time. `docs/methods.md` has the error and the time of each preset.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum Quality {
    /// The least work whose shadows are still right: for small GPUs and for motion. Creases a voxel wide blur, and
    /// slices show on surfaces at grazing angles.
    Low,
    /// The defaults of [`OcclusionRays`] and [`VolumeShading`].
    #[default]
    Medium,
    /// Smooth gradients and thin structures. Occlusion casts 2.7 times the rays of `Medium`, drawing takes twice the
    /// samples.
    High,
    /// For still pictures in print, and for comparison: the paper's ground truth of 512 rays. A change takes four to ten
    /// times as long as by `Medium`.
    Reference,
}

impl Quality {
    /// All presets, from the fastest to the most accurate.
    pub const ALL: [Self; 4] = [Self::Low, Self::Medium, Self::High, Self::Reference];

    /// The name used on command lines and in menus: `low`, `medium`, `high`, `reference`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Low => "low",
            Self::Medium => "medium",
            Self::High => "high",
            Self::Reference => "reference",
        }
    }

    /// The preset's rays, with the default reach.
    pub fn rays(self) -> OcclusionRays {
        let medium = OcclusionRays::default();
        match self {
            Self::Low => OcclusionRays {
                pattern: RayPattern::Fibonacci(14),
                resolution: OcclusionResolution::Half,
                ..medium
            },
            Self::Medium => medium,
            Self::High => OcclusionRays { pattern: RayPattern::Fibonacci(96), ..medium },
            Self::Reference => OcclusionRays { pattern: RayPattern::Sphere512, ..medium },
        }
    }

    /// The preset's view samples, with the default light.
    pub fn shading(self) -> VolumeShading {
        let medium = VolumeShading::default();
        match self {
            Self::Low => VolumeShading {
                step_voxels: 1.0,
                reconstruction: Reconstruction::Trilinear,
                outline_rays: 1,
                ..medium
            },
            Self::Medium => medium,
            Self::High => VolumeShading {
                step_voxels: 0.25,
                reconstruction: Reconstruction::SmoothOcclusion,
                outline_rays: 8,
                ..medium
            },
            // The slices are too thin to be seen, so that noise would only add an error.
            Self::Reference => VolumeShading {
                step_voxels: 0.125,
                reconstruction: Reconstruction::SmoothOcclusion,
                jitter: false,
                outline_rays: 32,
                ..medium
            },
        }
    }

    /// Sets a volume's rays, resolution and view samples to this preset.
    ///
    /// All else stays: the method, the reach of its rays (`steps` and `step_mm`), the sky and the light. A method
    /// without rays gets the view samples alone.
    pub fn apply(self, shading: &mut VolumeShading, occlusion: &mut AmbientOcclusion) {
        if let Some(rays) = occlusion.method.rays_mut() {
            let OcclusionRays { pattern, resolution, .. } = self.rays();
            *rays = OcclusionRays { pattern, resolution, ..*rays };
        }
        let VolumeShading { step_voxels, reconstruction, jitter, outline_rays, .. } = self.shading();
        *shading = VolumeShading { step_voxels, reconstruction, jitter, outline_rays, ..shading.clone() };
    }

    /// The preset of these settings; `None` if they are of no preset.
    pub fn of(shading: &VolumeShading, occlusion: &AmbientOcclusion) -> Option<Self> {
        let is_of = |quality: &Self| {
            let (mut with_shading, mut with_occlusion) = (shading.clone(), occlusion.clone());
            quality.apply(&mut with_shading, &mut with_occlusion);
            with_shading == *shading && with_occlusion == *occlusion
        };
        Self::ALL.into_iter().find(is_of)
    }
}

impl fmt::Display for Quality {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Quality {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|quality| quality.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("unknown quality `{name}`: expected one of {names}")
        })
    }
}
