//! Content of the texels of a volume's occlusion texture. The passes that write it and drawing agree by this.

use bevy::prelude::*;

/// Kinds of texels of an occlusion texture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum OcclusionTexels {
    /// The occlusion factor of a voxel.
    #[default]
    Factors,
    /// The occlusion factor of 2x2x2 voxels.
    HalfFactors,
    /// The occlusion factor of a voxel, and the share of its opacity that is drawn.
    Modulated,
    /// The light that each octant of directions brings to a voxel. Used by sweeping alone.
    ///
    /// A texel holds four octants. The texel of the other four lies farther along z, by the number of voxels along z.
    Octants,
}

impl OcclusionTexels {
    /// Number of texels along each axis for a volume of `voxels`.
    pub(crate) fn size(self, voxels: UVec3) -> UVec3 {
        match self {
            Self::Factors | Self::Modulated => voxels,
            Self::HalfFactors => (voxels + 1) / 2,
            Self::Octants => voxels * UVec3::new(1, 1, 2),
        }
    }

    /// Voxels along each side of the block that a texel stands for.
    pub(crate) fn stride(self) -> u32 {
        match self {
            Self::HalfFactors => 2,
            _ => 1,
        }
    }

    /// Whether a texel is one number, stored as opacities are. Other texels are four bytes.
    pub(crate) fn is_scalar(self) -> bool {
        matches!(self, Self::Factors | Self::HalfFactors)
    }

    /// Bytes of all texels; `scalar` is the bytes of one number.
    pub(crate) fn bytes(self, voxels: UVec3, scalar: u64) -> u64 {
        let texel = if self.is_scalar() { scalar } else { 4 };
        texel * self.size(voxels).as_u64vec3().element_product()
    }

    /// Shader definition that drawing is compiled with.
    pub(crate) fn shader_def(self) -> Option<&'static str> {
        match self {
            Self::Factors | Self::HalfFactors => None,
            Self::Modulated => Some("MODULATED"),
            Self::Octants => Some("OCTANTS"),
        }
    }
}
