//! The settings of volumetric ambient occlusion by filtering (Ruiz et al.: Volumetric Ambient Occlusion for
//! Volumetric Models, 2010).

use bevy::prelude::*;

use super::DensitySource;

/// How large a share of the voxels around one is not denser than it, estimated from what separable filters
/// find there: lowest, highest and mean density and the mean of its square. Every change filters the whole
/// volume; a voxel's cost does not grow with the radius.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct OcclusionFiltering {
    /// How the share is estimated.
    pub estimate: DensityEstimate,
    /// What is compared.
    pub density: DensitySource,
    /// Half the width of the box around a voxel, mm: the diameter of the paper's tangent sphere. A larger one
    /// finds larger hollows and blurs small ones. In whole voxels along each axis, at least 1, at most
    /// [`Self::MOST_VOXELS`]: occlusion pops where it changes.
    pub radius_mm: f32,
    /// The constant k of the ambient term k O(x) C(x) (equation 5); above 1 brightens.
    pub brightness: f32,
    /// What becomes transparent, so that more is seen of the rest.
    pub modulation: OpacityModulation,
}

impl OcclusionFiltering {
    /// The largest radius, voxels.
    pub const MOST_VOXELS: u32 = 127;
}

impl Default for OcclusionFiltering {
    fn default() -> Self {
        Self {
            estimate: DensityEstimate::default(),
            density: DensitySource::default(),
            radius_mm: 10.0,
            brightness: 1.0,
            modulation: OpacityModulation::default(),
        }
    }
}

/// How the share of voxels that are not denser is estimated.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub enum DensityEstimate {
    /// Chebyshev's one-tailed bound, from mean and variance (Penner and Mitchell 2008): nothing below the mean
    /// is lit, high contrast.
    Chebyshev,
    /// A distribution t^beta between lowest and highest, of the right mean (section 3.2).
    #[default]
    Power,
    /// A normal distribution of the right mean and variance (section 3.3): wrong where densities around a voxel
    /// have several modes.
    Gaussian,
}

/// What is drawn with less opacity.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub enum OpacityModulation {
    /// Nothing.
    #[default]
    None,
    /// What is uniform: where the variance of densities is below this one (section 4.2; densities in [0, 1]).
    Variance(f32),
    /// What is uniformly occluded: where the occlusion's gradient is below this one, per voxel.
    Gradient(f32),
}
