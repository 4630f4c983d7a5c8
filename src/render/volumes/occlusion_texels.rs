//! What the texels of a volume's occlusion texture hold: what computes them and what draws them agree by this.

use bevy::{prelude::*, render::render_resource::TextureFormat};

use crate::{
    occlusion::{AmbientOcclusion, GeometryTerm, OcclusionMethod, OcclusionResolution, OpacityModulation},
    render::gpu::formats::Formats,
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
    /// What settings call for.
    pub fn of(occlusion: &AmbientOcclusion) -> Self {
        match occlusion.method {
            OcclusionMethod::Sweeping(sweeping) if sweeping.geometry_term != GeometryTerm::None => {
                Self::Octants
            }
            OcclusionMethod::Filtering(filtering) if filtering.modulation != OpacityModulation::None => {
                Self::Modulated
            }
            _ if occlusion.clamped().resolution == OcclusionResolution::Half => Self::HalfFactors,
            _ => Self::Factors,
        }
    }

    /// Number of texels for a volume of so many voxels.
    pub fn size(self, voxels: UVec3) -> UVec3 {
        match self {
            Self::Factors | Self::Modulated => voxels,
            Self::HalfFactors => (voxels + 1) / 2,
            Self::Octants => voxels * UVec3::new(1, 1, 2),
        }
    }

    /// Their format.
    pub fn format(self, formats: &Formats) -> TextureFormat {
        match self {
            Self::Factors | Self::HalfFactors => formats.scalar,
            Self::Modulated | Self::Octants => TextureFormat::Rgba8Unorm,
        }
    }

    /// Bytes of all of them; a scalar is stored in so many.
    pub fn bytes(self, voxels: UVec3, scalar: u64) -> u64 {
        let texel = match self {
            Self::Factors | Self::HalfFactors => scalar,
            Self::Modulated | Self::Octants => 4,
        };
        texel * self.size(voxels).as_u64vec3().element_product()
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
