//! Memory budget of volumes on the GPU, and the size of a volume.

use bevy::{prelude::*, render::render_resource::WgpuLimits};

use super::{Intensities, LookupTable, Volume};

/// GPU memory that volumes and carvers may take.
#[derive(Resource, Reflect, Clone, Debug, PartialEq)]
#[reflect(Resource, Default, Debug, Clone, PartialEq)]
pub struct VolumeBudget {
    /// Bytes for all volumes together and for the depth maps of carvers.
    ///
    /// A volume takes 3.8 bytes a voxel if it has 8 bits, 4.8 if it has 16. A device that cannot store single bytes
    /// takes 6 more. The volume's [`OcclusionMethod`](crate::occlusion::OcclusionMethod) adds its own bytes. Buffers
    /// that screen-space and directional occlusion keep for each view go by its pixels and are not counted. Nor is the table of
    /// a transfer function that follows the gradient, 6 MB.
    ///
    /// A volume beyond the budget is refused or halved. A method beyond it leaves a volume without occlusion. Carvers
    /// beyond it do not carve. A higher budget shows more, as long as the device has the memory. The device cannot be
    /// asked how much memory it has.
    pub max_bytes: u64,
    /// Shows a volume that exceeds the budget or the device's largest texture at half its resolution or less, with a
    /// warning. Otherwise the volume is refused with [`VolumeFailed`](super::VolumeFailed). It is shown whole when
    /// there is room.
    pub halves: bool,
}

impl Default for VolumeBudget {
    fn default() -> Self {
        Self { max_bytes: 4 << 30, halves: false }
    }
}

/// Bytes of the budget that are in use.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct BytesTaken {
    pub by_volumes: u64,
    /// By the resources of occlusion methods.
    pub by_methods: u64,
    /// By the depth maps of carvers.
    pub by_carvers: u64,
}

/// Bytes that the device takes for the values of a voxel.
#[derive(Resource, Clone, Copy, Debug)]
pub(crate) struct StoredBytes {
    /// Bytes of an opacity or an occlusion factor.
    pub scalar: u64,
    /// Bytes of a 16-bit intensity.
    pub intensity16: u64,
}

impl Default for StoredBytes {
    fn default() -> Self {
        Self { scalar: 1, intensity16: 2 }
    }
}

/// Size of a volume, which decides whether it can be shown.
#[derive(Clone, Copy)]
pub(crate) struct VolumeSize {
    pub dimensions: UVec3,
    bytes_per_voxel: u64,
}

impl VolumeSize {
    /// Size of a volume with its intensities, opacities and occlusion factors.
    pub fn of(volume: &Volume, stored: StoredBytes) -> Self {
        let intensity = match volume.intensities() {
            Intensities::U8(_) => 1,
            Intensities::U16(_) => stored.intensity16,
        };
        Self { dimensions: volume.dimensions(), bytes_per_voxel: intensity + 2 * stored.scalar }
    }

    /// Size of a volume that is yet to be read, on a device that stores single bytes.
    #[cfg(feature = "dicom")]
    pub fn of_grid(dimensions: UVec3, bytes_per_intensity: u64) -> Self {
        Self { dimensions, bytes_per_voxel: bytes_per_intensity + 2 }
    }

    fn halved(self) -> Self {
        Self { dimensions: self.dimensions.map(|voxels| voxels.div_ceil(2)), ..self }
    }

    /// Bytes of the volume, without its occlusion method.
    pub fn bytes(self) -> u64 {
        let voxels = self.dimensions.as_u64vec3().element_product();
        let bricks = self.bricks() * Self::BYTES_PER_BRICK + self.cubes(16) * Self::BYTES_PER_SUPERBRICK;
        voxels * self.bytes_per_voxel + bricks + Self::BYTES_OF_TABLES
    }

    /// Number of bricks of 4x4x4 voxels.
    fn bricks(self) -> u64 {
        self.cubes(4)
    }

    /// Number of cubes of so many voxels along each side.
    fn cubes(self, side: u32) -> u64 {
        self.dimensions.map(|voxels| voxels.div_ceil(side)).as_u64vec3().element_product()
    }

    /// Bytes per brick in all buffers together, and in the largest buffer.
    const BYTES_PER_BRICK: u64 = 56;
    const MAX_BYTES_PER_BRICK: u64 = 24;
    /// Bytes per superbrick of 4x4x4 bricks: its state, and its places in two lists.
    const BYTES_PER_SUPERBRICK: u64 = 20;
    /// Bytes of the lookup table (six rows), of the counts of opaque entries before each entry, and of the list
    /// heads.
    const BYTES_OF_TABLES: u64 =
        6 * 16 * LookupTable::ENTRIES as u64 + 4 * (LookupTable::ENTRIES as u64 + 1) + 3 * 32;
}

/// A volume that does not fit, with the dimensions that would fit.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{dimensions} voxels {limit}{}", would_fit.map_or_else(String::new, |dimensions| {
    format!("; {dimensions} would fit, which VolumeBudget::halves allows")
}))]
pub struct TooLarge {
    /// Dimensions of the volume.
    pub dimensions: UVec3,
    /// The limit that the volume exceeds.
    pub limit: SizeLimit,
    /// Dimensions after the fewest halvings that make the volume fit, if any do.
    pub would_fit: Option<UVec3>,
}

/// A limit on the size of a volume.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SizeLimit {
    /// Texels of a 3D texture along an axis.
    #[error("are too many: this graphics device holds at most {max} along each axis")]
    Texture {
        /// Texels that the device holds.
        max: u32,
    },
    /// Bytes of a storage buffer.
    #[error("need a buffer of {needed} bytes: this graphics device binds at most {max}")]
    Buffer {
        /// Bytes that the volume needs.
        needed: u64,
        /// Bytes that the device binds.
        max: u64,
    },
    /// Bytes of [`VolumeBudget`].
    #[error(
        "take {} MiB on the graphics device beside {} MiB that are taken, and VolumeBudget allows {} MiB",
        mib(*.needed), mib(*.taken), mib(*.max)
    )]
    Budget {
        /// Bytes that the volume needs.
        needed: u64,
        /// Bytes that others take.
        taken: u64,
        /// Bytes that the budget allows.
        max: u64,
    },
}

/// Whole MiB, rounded up.
fn mib(bytes: u64) -> u64 {
    bytes.div_ceil(1 << 20)
}

impl VolumeBudget {
    /// Checks that a volume can be shown. `device` has the device's limits; `taken` are the bytes of others.
    pub(crate) fn check(&self, size: VolumeSize, device: &WgpuLimits, taken: u64) -> Result<(), SizeLimit> {
        let max = device.max_texture_dimension_3d;
        if size.dimensions.max_element() > max {
            return Err(SizeLimit::Texture { max });
        }
        let (needed, max) =
            (size.bricks() * VolumeSize::MAX_BYTES_PER_BRICK, device.max_storage_buffer_binding_size);
        if needed > max {
            return Err(SizeLimit::Buffer { needed, max });
        }
        let (needed, max) = (size.bytes(), self.max_bytes);
        if taken.saturating_add(needed) > max {
            return Err(SizeLimit::Budget { needed, taken, max });
        }
        Ok(())
    }

    /// Number of halvings after which a volume can be shown, and its size then; `None` if not even one
    /// voxel can be shown.
    pub(crate) fn halvings(
        &self,
        mut size: VolumeSize,
        device: &WgpuLimits,
        taken: u64,
    ) -> Option<(u32, VolumeSize)> {
        for halvings in 0.. {
            if self.check(size, device, taken).is_ok() {
                return Some((halvings, size));
            }
            if size.dimensions == UVec3::ONE {
                break;
            }
            size = size.halved();
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_volume_beyond_the_largest_buffer_is_refused_by_name() {
        let size = VolumeSize { dimensions: UVec3::splat(512), bytes_per_voxel: 3 };
        let small = WgpuLimits { max_storage_buffer_binding_size: 1 << 20, ..default() };
        let budget = VolumeBudget::default();
        let refused = budget.check(size, &small, 0).expect_err("its masks have 48 MiB");
        assert_eq!(refused, SizeLimit::Buffer { needed: 50_331_648, max: 1 << 20 });
        let (halvings, fits) = budget.halvings(size, &small, 0).expect("a quarter fits");
        assert_eq!((halvings, fits.dimensions), (2, UVec3::splat(128)));
        assert_eq!(budget.check(size, &WgpuLimits::default(), 0), Ok(()));
    }

    #[test]
    fn what_others_take_counts() {
        let size = VolumeSize { dimensions: UVec3::splat(64), bytes_per_voxel: 3 };
        let budget = VolumeBudget { max_bytes: 2 * size.bytes(), halves: false };
        assert_eq!(budget.check(size, &default(), size.bytes()), Ok(()));
        let refused = budget.check(size, &default(), size.bytes() + 1).expect_err("a byte too many");
        assert!(refused.to_string().contains("VolumeBudget allows 3 MiB"), "{refused}");
    }
}
