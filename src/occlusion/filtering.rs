//! The settings of volumetric ambient occlusion by filtering (Ruiz et al.: Volumetric Ambient Occlusion for
//! Volumetric Models, 2010).

use bevy::prelude::*;

use super::{MethodBytes, MethodDrawing, MethodSettings, OcclusionTexels, lengths::length_mm};
use crate::volume::VolumeGeometry;

/// How large a share of the voxels around one is not denser than it, estimated from what separable filters
/// find there: lowest, highest and mean density and the mean of its square. Every change filters the whole
/// volume; a voxel's cost does not grow with the radius. It takes 16 bytes a voxel more, 24 where variance
/// modulates [`DensityEstimate::Power`]; a volume with more than a device binds at once is drawn without
/// occlusion.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct OcclusionFiltering {
    /// How the share is estimated.
    pub estimate: DensityEstimate,
    /// What is compared.
    pub density: DensitySource,
    /// Half the width of the box around a voxel, mm: the diameter of the paper's tangent sphere; `None` is 10
    /// voxels. A larger one finds larger hollows and blurs small ones. In whole voxels along each axis, at least
    /// 1, at most [`Self::MAX_VOXELS`]: occlusion pops where it changes.
    pub radius_mm: Option<f32>,
    /// The constant k of the ambient term k O(x) C(x) (equation 5); above 1 brightens. A byte a voxel keeps
    /// k O(x), at most 1.
    pub brightness: f32,
    /// What becomes transparent, so that more is seen of the rest.
    pub modulation: OpacityModulation,
}

impl OcclusionFiltering {
    /// The largest radius, voxels.
    pub const MAX_VOXELS: u32 = 127;
    /// The passes over all volumes that are filtered, in the diagnostics.
    pub const SPAN: &str = "contextual_ao/filter";

    /// These settings within what can be computed.
    pub(super) fn clamped(self) -> Self {
        let within = |value: f32| if value.is_nan() { 0.0 } else { value.clamp(0.0, f32::MAX) };
        Self {
            radius_mm: self.radius_mm.map(within),
            brightness: if self.brightness.is_nan() { 1.0 } else { within(self.brightness) },
            modulation: match self.modulation {
                OpacityModulation::None => OpacityModulation::None,
                OpacityModulation::Variance(variance) => OpacityModulation::Variance(within(variance)),
                OpacityModulation::Gradient(gradient) => OpacityModulation::Gradient(within(gradient)),
            },
            ..self
        }
    }

    /// The radius, mm: the one that is set, or 10 voxels.
    pub fn radius_length_mm(&self, geometry: &VolumeGeometry) -> f64 {
        length_mm(self.radius_mm, 10.0, geometry)
    }

    /// Whether the means of squares are filtered, beside the means.
    pub(crate) fn filters_squares(&self) -> bool {
        !self.filters_extrema() || matches!(self.modulation, OpacityModulation::Variance(_))
    }

    /// Whether the lowest and the highest densities are filtered, beside the means.
    pub(crate) fn filters_extrema(&self) -> bool {
        self.estimate == DensityEstimate::Power
    }

    /// How many quantities are filtered.
    fn quantities(&self) -> u32 {
        1 + u32::from(self.filters_squares()) + u32::from(self.filters_extrema())
    }

    /// The radius along each of the grid's axes, whole voxels.
    pub fn radii(&self, geometry: &VolumeGeometry) -> UVec3 {
        let voxels = (self.radius_length_mm(geometry) / geometry.spacing_mm).round().as_uvec3();
        voxels.clamp(UVec3::ONE, UVec3::splat(Self::MAX_VOXELS))
    }
}

impl MethodSettings for OcclusionFiltering {
    fn name(&self) -> &'static str {
        "filtering"
    }

    fn bytes(&self, dimensions: UVec3) -> MethodBytes {
        let buffer = 4 * dimensions.as_u64vec3().element_product();
        MethodBytes { total: 2 * buffer * u64::from(self.quantities()), largest_buffer: buffer }
    }

    fn drawing(&self) -> MethodDrawing {
        let texels = match self.modulation {
            OpacityModulation::None => OcclusionTexels::Factors,
            _ => OcclusionTexels::Modulated,
        };
        MethodDrawing { texels, ..default() }
    }
}

impl Default for OcclusionFiltering {
    fn default() -> Self {
        Self {
            estimate: DensityEstimate::default(),
            density: DensitySource::default(),
            radius_mm: None,
            brightness: 1.0,
            modulation: OpacityModulation::default(),
        }
    }
}

/// What of a clipped volume is taken for its density.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum DensitySource {
    /// The opacity that the transfer function gives: occlusion fits what is seen, but where the function is
    /// steep opacities jump from voxel to voxel, and single voxels show.
    Opacity,
    /// The intensity, as in the paper, whatever is seen of it; the lowest where it is clipped.
    #[default]
    Intensity,
}

/// How the share of voxels that are not denser is estimated.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
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
#[non_exhaustive]
pub enum OpacityModulation {
    /// Nothing.
    #[default]
    None,
    /// What is uniform: where the variance of densities is below this one (section 4.2; densities in [0, 1],
    /// intensities over the volume's range).
    Variance(f32),
    /// What is uniformly occluded: where the occlusion's gradient is below this one, per voxel.
    Gradient(f32),
}
