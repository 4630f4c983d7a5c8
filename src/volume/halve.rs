//! Volumes at half their resolution.

use bevy::math::{DAffine3, DVec3, UVec3};

use super::{Intensities, Volume};

impl Volume {
    /// This volume with half as many voxels along each axis (rounded up), in the same place in the patient.
    ///
    /// Each voxel is the mean of the 2x2x2 voxels that it replaces, or of fewer at the far faces.
    pub fn halved(&self) -> Self {
        let from = self.dimensions();
        let dimensions = from.map(|voxels| voxels.div_ceil(2));
        let intensities = match self.intensities() {
            Intensities::U8(values) => Intensities::U8(means(values, from, dimensions)),
            Intensities::U16(values) => Intensities::U16(means(values, from, dimensions)),
        };
        // An axis of a single voxel is not halved.
        let steps = from.map(|voxels| voxels.min(2)).as_dvec3();
        let old_from_new =
            DAffine3::from_scale_rotation_translation(steps, Default::default(), (steps - DVec3::ONE) * 0.5);
        Self::new(dimensions, self.grid_to_patient() * old_from_new, intensities, self.rescale())
            .expect("half of a valid volume is valid")
    }
}

/// Rounded means of the blocks of `from` that make the voxels of `to`.
fn means<T: Copy + Into<u32> + TryFrom<u32>>(values: &[T], from: UVec3, to: UVec3) -> Vec<T> {
    let [width, height, _] = from.to_array().map(|size| size as usize);
    let range = |at: u32, size: u32| (2 * at as usize)..((2 * at + 2).min(size) as usize);
    let mut means = Vec::with_capacity(to.to_array().iter().map(|&size| size as usize).product());
    for z in 0..to.z {
        for y in 0..to.y {
            for x in 0..to.x {
                let (mut sum, mut count) = (0u32, 0u32);
                for z in range(z, from.z) {
                    for y in range(y, from.y) {
                        for x in range(x, from.x) {
                            sum += values[(z * height + y) * width + x].into();
                            count += 1;
                        }
                    }
                }
                // A mean is no larger than the largest value.
                means.extend(T::try_from((sum + count / 2) / count.max(1)).ok());
            }
        }
    }
    means
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Rescale;

    #[test]
    fn half_a_volume_is_in_the_same_place() {
        let dimensions = UVec3::new(5, 4, 1);
        let values: Vec<u16> = (0..20).map(|k| 1000 * k).collect();
        let grid = DAffine3::from_translation(DVec3::new(10.0, -3.0, 2.0))
            * DAffine3::from_scale(DVec3::new(1.0, 2.0, 3.0));
        let volume = Volume::new(dimensions, grid, Intensities::U16(values), Rescale::default()).unwrap();
        let half = volume.halved();
        assert_eq!(half.dimensions(), UVec3::new(3, 2, 1));
        assert_eq!(half.spacing_mm(), bevy::math::Vec3::new(2.0, 4.0, 3.0));
        // The means of voxels 0, 1, 5 and 6, and of voxels 4 and 9 at the end of a row.
        assert_eq!(half.value_at(UVec3::ZERO), Some(3000.0));
        assert_eq!(half.value_at(UVec3::new(2, 0, 0)), Some(6500.0));
        let first = half.grid_to_patient().transform_point3(DVec3::ZERO);
        assert_eq!(first, grid.transform_point3(DVec3::new(0.5, 0.5, 0.0)));
    }
}
