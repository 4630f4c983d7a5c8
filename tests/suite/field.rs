//! Numbers on a volume's grid, as the references on the CPU read them.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::prelude::*;

use crate::headless::voxel_at;

/// Numbers on a grid, trilinear or cubic in between. Beyond the outermost voxels' centres, they stay constant.
pub struct Field {
    size: UVec3,
    values: Vec<f64>,
}

impl Field {
    /// `values` has x fastest.
    pub fn new(size: UVec3, values: Vec<f64>) -> Self {
        assert_eq!(values.len(), size.element_product() as usize);
        Self { size, values }
    }

    /// A volume's intensities.
    pub fn of(volume: &Volume) -> Self {
        let size = volume.dimensions();
        let indices = 0..size.element_product();
        Self::new(size, indices.map(|k| volume.value_at(voxel_at(k, size)).unwrap_or_default()).collect())
    }

    /// Bytes as shares of 1.
    pub fn of_bytes(size: UVec3, bytes: impl IntoIterator<Item = u8>) -> Self {
        Self::new(size, bytes.into_iter().map(|byte| f64::from(byte) / 255.0).collect())
    }

    /// The number at a place, voxels from the first voxel's centre.
    pub fn at(&self, place: DVec3) -> f64 {
        let last = self.size.as_dvec3() - 1.0;
        let place = place.clamp(DVec3::ZERO, last);
        let first = place.floor();
        let f = place - first;
        let corner = |k: u32| {
            let far = UVec3::new(k & 1, k >> 1 & 1, k >> 2);
            let weight = DVec3::select(far.cmpeq(UVec3::ONE), f, 1.0 - f).element_product();
            let voxel = (first.as_uvec3() + far).min(self.size - 1);
            weight * self.values[((voxel.z * self.size.y + voxel.y) * self.size.x + voxel.x) as usize]
        };
        (0..8).map(corner).sum()
    }

    /// The same number by a tricubic B-spline without the blur that it adds: a sixth of the second differences.
    pub fn sharp_at(&self, place: DVec3) -> f64 {
        let around = DVec3::AXES.map(|axis| self.at(place + axis) + self.at(place - axis));
        self.spline_at(place) - (around.iter().sum::<f64>() - 6.0 * self.at(place)) / 6.0
    }

    /// The same number by a tricubic B-spline.
    pub fn spline_at(&self, place: DVec3) -> f64 {
        let first = place.floor();
        let f = place - first;
        let weights = |f: f64| {
            [
                (1.0 - f).powi(3),
                4.0 - 6.0 * f * f + 3.0 * f.powi(3),
                1.0 + 3.0 * f + 3.0 * f * f - 3.0 * f.powi(3),
                f.powi(3),
            ]
        };
        let [x, y, z] = f.to_array().map(weights);
        let value = |k: usize| {
            let offset = [k % 4, k / 4 % 4, k / 16];
            let voxel = first + DVec3::from_array(offset.map(|offset| offset as f64 - 1.0));
            // Whole places have one voxel each.
            x[offset[0]] * y[offset[1]] * z[offset[2]] / 216.0 * self.at(voxel)
        };
        (0..64).map(value).sum()
    }
}
