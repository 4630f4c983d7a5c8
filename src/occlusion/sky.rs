//! Light from each octant of directions.

use bevy::{math::DVec3, prelude::*};

use super::octants::{octant_center, octant_shares};
use crate::volume::VolumeGeometry;

/// Weights of the light from each octant of directions.
///
/// They are the optional weights w_k of the CAO paper (section 3.4, equation 3). They are also the chosen octants of
/// occlusion sweeping (Singh et al., section 3 and figure 7).
///
/// Octants are those of volume space ([`VolumeGeometry`]). Bit 0 of an octant's number is set on the side of +x, bit 1
/// on that of +y, bit 2 on that of +z. The sky turns with the volume. Only the weights' ratios count. Equal weights,
/// the default, are an overcast sky on all sides. Rays of weight 0 are not cast. Sweeping goes along the axes of the
/// grid. Where these differ from the axes of volume space, a grid's octant gets the mean weight of its directions.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct Sky(pub [f32; 8]);

impl Default for Sky {
    fn default() -> Self {
        Self([1.0; 8])
    }
}

impl Sky {
    /// Light from a single octant, which gives a low-frequency shadow (Singh et al., section 4.1).
    pub fn octant(octant: usize) -> Self {
        let mut weights = [0.0; 8];
        weights[octant % 8] = 1.0;
        Self(weights)
    }

    /// Light from the octants, about four, on the side of a direction of volume space. Upwards (+y) gives a cloudy
    /// day.
    pub fn above(up: Vec3) -> Self {
        Self(core::array::from_fn(|octant| f32::from(octant_center(octant).dot(up.as_dvec3()) > 1e-3)))
    }

    /// The weights scaled to a mean of 1; all 1 if no weight is valid and above 0.
    pub fn normalized(&self) -> [f32; 8] {
        let weights = self.0.map(|weight| if weight.is_finite() { weight.max(0.0) } else { 0.0 });
        let mean = weights.iter().sum::<f32>() / 8.0;
        if mean > 0.0 { weights.map(|weight| weight / mean) } else { [1.0; 8] }
    }

    /// The weight of a direction, volume space. On the border between octants it is the mean of their weights.
    pub(super) fn weight(&self, direction: DVec3) -> f64 {
        let weights = self.normalized();
        let touched = (0..8).filter(|&octant| (octant_center(octant) * direction).min_element() > -1e-9);
        let (sum, count) = touched.fold((0.0, 0), |(sum, count), octant| (sum + weights[octant], count + 1));
        f64::from(sum) / f64::from(count.max(1))
    }

    /// The weights of the octants of a grid's axes. Bit `a` of an octant's number is set where directions go to larger
    /// indices along axis `a`.
    pub(crate) fn of_grid(&self, geometry: &VolumeGeometry) -> [f32; 8] {
        let weights = self.normalized();
        if *self == Self::default() {
            // By far the most frequent sky, asked for in every frame.
            return weights;
        }
        core::array::from_fn(|octant| {
            let shares = octant_shares(geometry.local_from_voxel.matrix3, octant);
            let weighted = shares.iter().zip(weights).map(|(share, weight)| share * f64::from(weight));
            weighted.sum::<f64>() as f32
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::math::{DAffine3, DMat3};

    #[test]
    fn directions_have_the_weights_of_their_octants() {
        let sky = Sky([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
        assert!((sky.weight(DVec3::new(0.1, -0.2, 0.3)) - 6.0 / 4.5).abs() < 1e-6);
        // Along an axis: the mean of the four octants around the axis.
        assert!((sky.weight(DVec3::Z) - 6.5 / 4.5).abs() < 1e-6);
        assert_eq!(Sky::above(Vec3::Y).0, [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0]);
        assert_eq!(Sky::octant(3).normalized()[3], 8.0);
    }

    #[test]
    fn the_sky_of_a_grid_is_that_of_volume_space() {
        let sky = Sky([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
        let grid = |axes| {
            let local_from_voxel = DAffine3::from_mat3(axes);
            let geometry =
                VolumeGeometry { dimensions: UVec3::ONE, spacing_mm: DVec3::ONE, local_from_voxel };
            sky.of_grid(&geometry).map(|weight| 4.5 * weight)
        };
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z];
        // Equal bit for bit, however the grid is stretched.
        assert_eq!(grid(DMat3::from_cols(2.0 * x, y, 9.0 * z)), sky.0);
        let turned = grid(DMat3::from_cols(-x, z, y));
        assert_eq!(turned, [2.0, 1.0, 6.0, 5.0, 4.0, 3.0, 8.0, 7.0]);
        // Half-way between two axes, an octant of the grid lies half in each of two octants of volume space.
        let half = (x + y).normalize();
        let turned = grid(DMat3::from_cols(half, half.cross(-z), z));
        assert!((turned[7] - 0.5 * (7.0 + 8.0)).abs() < 1e-5, "{turned:?}");
    }

    #[test]
    fn no_weights_are_weights_of_one() {
        for weights in [[0.0; 8], [-1.0; 8], [f32::NAN; 8]] {
            assert_eq!(Sky(weights).normalized(), [1.0; 8]);
        }
    }
}
