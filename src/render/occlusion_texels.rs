//! What the texels of a volume's occlusion texture hold: what computes them and what draws them agree by this.

use bevy::{
    log::warn_once,
    prelude::*,
    render::{render_resource::TextureFormat, renderer::RenderDevice},
};

use super::{formats::Formats, textures::largest_storage_buffer};
use crate::occlusion::{
    AmbientOcclusion, GeometryTerm, OcclusionMethod, OcclusionResolution, OpacityModulation,
};

/// Kinds of texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) enum OcclusionTexels {
    /// The factor of a voxel.
    #[default]
    Factors,
    /// The factor of 2x2x2 voxels.
    HalfFactors,
    /// The factor of a voxel and the share of its opacity that is drawn.
    Modulated,
    /// How much light each octant of directions brings to a voxel: four in a texel, the other four as many
    /// texels farther along z as there are voxels.
    Octants,
}

impl OcclusionTexels {
    /// What a volume's settings call for, and the device can hold.
    pub fn of(occlusion: &AmbientOcclusion, voxels: UVec3, device: &RenderDevice) -> Self {
        match occlusion.method {
            OcclusionMethod::Sweeping(sweeping) if sweeping.geometry_term != GeometryTerm::None => {
                if holds_octants(voxels, device) {
                    Self::Octants
                } else {
                    Self::Factors
                }
            }
            OcclusionMethod::Filtering(filtering) if filtering.modulation != OpacityModulation::None => {
                Self::Modulated
            }
            _ if occlusion.clamped().resolution == OcclusionResolution::Half => Self::HalfFactors,
            _ => Self::Factors,
        }
    }

    /// Number and format of the texels for a volume of so many voxels.
    pub fn texture(self, voxels: UVec3, formats: &Formats) -> (UVec3, TextureFormat) {
        match self {
            Self::Factors => (voxels, formats.scalar),
            Self::HalfFactors => ((voxels + 1) / 2, formats.scalar),
            Self::Modulated => (voxels, TextureFormat::Rgba8Unorm),
            Self::Octants => (voxels * UVec3::new(1, 1, 2), TextureFormat::Rgba8Unorm),
        }
    }

    /// What the material is compiled with.
    pub fn shader_def(self) -> Option<&'static str> {
        match self {
            Self::Factors | Self::HalfFactors => None,
            Self::Modulated => Some("MODULATED"),
            Self::Octants => Some("OCTANTS"),
        }
    }
}

/// Whether a device has room for the octants of so many voxels.
fn holds_octants(voxels: UVec3, device: &RenderDevice) -> bool {
    let bytes = 8 * voxels.as_u64vec3().element_product();
    let holds =
        2 * voxels.z <= device.limits().max_texture_dimension_3d && bytes <= largest_storage_buffer(device);
    if !holds {
        warn_once!("the device cannot hold eight octants of {voxels} voxels: swept without geometry term");
    }
    holds
}
