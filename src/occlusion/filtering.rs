//! The settings of volumetric ambient occlusion by filtering (Ruiz et al.: Volumetric Ambient Occlusion for
//! Volumetric Models, 2010).

use bevy::prelude::*;

use super::{
    MethodBytes, MethodDrawing, MethodSettings, OcclusionTexels,
    lengths::{length_mm, whole_voxels},
};
use crate::volume::VolumeGeometry;

/// Occlusion by the share of voxels around a voxel that are not denser than it.
///
/// The share is estimated from the lowest, the highest and the mean density and the mean of the density's square.
/// Separable filters find these. Every change filters the whole volume; a voxel's cost does not grow with the radius.
/// The method takes 16 bytes a voxel more, 24 where variance modulates [`DensityEstimate::Power`]. A volume with a
/// buffer larger than the device binds is drawn without occlusion.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct OcclusionFiltering {
    /// Estimate of the share.
    pub estimate: DensityEstimate,
    /// The quantity that is compared.
    pub density: DensitySource,
    /// Half the width of the box around a voxel, mm: the diameter of the paper's tangent sphere. `None` is 10 voxels.
    /// A larger radius finds larger hollows and blurs small ones. It is rounded to whole voxels along each axis, at
    /// least 1, at most [`Self::MAX_VOXELS`]: occlusion pops when their number changes.
    pub radius_mm: Option<f32>,
    /// Constant k of the ambient term k O(x) C(x) (equation 5). Values above 1 brighten. A byte a voxel keeps k O(x),
    /// at most 1.
    pub brightness: f32,
    /// Regions that become transparent, so that more of the rest is visible.
    pub modulation: OpacityModulation,
}

impl OcclusionFiltering {
    /// Largest radius, voxels.
    pub const MAX_VOXELS: u32 = 127;
    /// Diagnostics span of the passes over all filtered volumes.
    pub const SPAN: &str = "contextual_ao/filter";

    /// Limits these settings to their valid ranges.
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

    /// The radius, mm: the one set, or 10 voxels.
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

    /// Number of filtered quantities; the extrema count as one.
    fn quantities(&self) -> u32 {
        1 + u32::from(self.filters_squares()) + u32::from(self.filters_extrema())
    }

    /// The radius along each axis of the grid, whole voxels.
    pub fn radii(&self, geometry: &VolumeGeometry) -> UVec3 {
        whole_voxels(self.radius_length_mm(geometry), Self::MAX_VOXELS, geometry)
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

/// The quantity of a clipped volume that counts as its density.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum DensitySource {
    /// The opacity that the transfer function gives. Occlusion then fits the visible structures. But where the
    /// function is steep, opacities jump from voxel to voxel, and single voxels show.
    Opacity,
    /// The intensity, as in the paper, whether it is visible or not. Clipped voxels have the lowest.
    #[default]
    Intensity,
}

/// Estimate of the share of voxels that are not denser.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum DensityEstimate {
    /// Chebyshev's one-tailed bound, from mean and variance (Penner and Mitchell 2008). Below the mean the bound says
    /// nothing, and voxels get no light: the dark pictures of Ruiz et al., figures 5 to 8.
    Chebyshev,
    /// A distribution t^beta between the lowest and the highest density, with the right mean (section 3.2).
    #[default]
    Power,
    /// A normal distribution with the right mean and variance (section 3.3). Wrong where the densities around a voxel
    /// have several modes.
    Gaussian,
    /// [`DensityEstimate::Chebyshev`], with voxels below the mean not occluded, as the text of Ruiz et al. says
    /// (section 4.1). The contrast at the mean is the highest possible.
    ChebyshevOpen,
}

/// Regions that are drawn with less opacity.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum OpacityModulation {
    /// No regions.
    #[default]
    None,
    /// Uniform regions: the variance of densities is below this value (section 4.2). Densities are in [0, 1],
    /// intensities over the volume's range.
    Variance(f32),
    /// Uniformly occluded regions: the occlusion's gradient, per voxel, is below this value.
    Gradient(f32),
}
