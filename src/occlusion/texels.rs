//! What the texels of a volume's occlusion texture hold: what computes them and what draws them agree by this.

use bevy::prelude::*;

/// Kinds of texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum OcclusionTexels {
    /// The factor of a voxel.
    #[default]
    Factors,
    /// The factor of 2x2x2 voxels.
    HalfFactors,
    /// The factor of a voxel and the share of its opacity that is drawn.
    Modulated,
    /// How much light each octant of directions brings to a voxel: four in a texel, the other four as many texels
    /// farther along z as there are voxels. Of sweeping alone.
    Octants,
}

impl OcclusionTexels {
    /// Number of texels for a volume of so many voxels.
    pub(crate) fn size(self, voxels: UVec3) -> UVec3 {
        match self {
            Self::Factors | Self::Modulated => voxels,
            Self::HalfFactors => (voxels + 1) / 2,
            Self::Octants => voxels * UVec3::new(1, 1, 2),
        }
    }

    /// Voxels along each side of what a texel is of.
    pub(crate) fn stride(self) -> u32 {
        match self {
            Self::HalfFactors => 2,
            _ => 1,
        }
    }

    /// Whether a texel is one number, stored as opacities are; others are four bytes.
    pub(crate) fn is_scalar(self) -> bool {
        matches!(self, Self::Factors | Self::HalfFactors)
    }

    /// Bytes of all of them; a scalar is stored in so many.
    pub(crate) fn bytes(self, voxels: UVec3, scalar: u64) -> u64 {
        let texel = if self.is_scalar() { scalar } else { 4 };
        texel * self.size(voxels).as_u64vec3().element_product()
    }

    /// What the material is compiled with.
    pub(crate) fn shader_def(self) -> Option<&'static str> {
        match self {
            Self::Factors | Self::HalfFactors => None,
            Self::Modulated => Some("MODULATED"),
            Self::Octants => Some("OCTANTS"),
        }
    }
}
