//! Size of a volume on a graphics device, about as the plugin counts it.

use bevy::math::UVec3;

pub(crate) struct VolumeSize(u64);

impl VolumeSize {
    pub(crate) fn of_grid(dimensions: UVec3, bytes_per_intensity: u64) -> Self {
        let voxels: u64 = dimensions.to_array().into_iter().map(u64::from).product();
        Self(voxels * (bytes_per_intensity + 3))
    }

    pub(crate) fn bytes(self) -> u64 {
        self.0
    }
}
