//! Where the light comes from: a weight for every octant of directions.

use bevy::{math::DVec3, prelude::*};

/// How much light comes from each octant of directions: the optional weights w_k of the CAO paper (section
/// 3.5, equation 3), and the chosen octants of occlusion sweeping (Singh et al., section 3 and figure 7).
///
/// Octants are those of the grid's axes, not of the world's: bit `a` of an octant's number is set where
/// directions go to larger indices along axis `a`. Only the weights' ratios count. All alike, the default,
/// is an overcast sky on all sides; rays of weight 0 are not cast.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct Sky(pub [f32; 8]);

impl Default for Sky {
    fn default() -> Self {
        Self([1.0; 8])
    }
}

impl Sky {
    /// Light from a single octant: a low-frequency shadow (Singh et al., section 4.1).
    pub fn octant(octant: usize) -> Self {
        let mut weights = [0.0; 8];
        weights[octant % 8] = 1.0;
        Self(weights)
    }

    /// Light from the four octants, more or fewer, that lie in a direction (along the grid's axes): a cloudy
    /// day, where it is upwards.
    pub fn above(up: Vec3) -> Self {
        Self(core::array::from_fn(|octant| f32::from(octant_center(octant).dot(up.as_dvec3()) > 1e-3)))
    }

    /// The weights with a mean of 1; all alike where they are no weights.
    pub fn normalized(&self) -> [f32; 8] {
        let weights = self.0.map(|weight| if weight.is_finite() { weight.max(0.0) } else { 0.0 });
        let mean = weights.iter().sum::<f32>() / 8.0;
        if mean > 0.0 { weights.map(|weight| weight / mean) } else { [1.0; 8] }
    }

    /// The weight of a direction along the grid's axes; between octants the mean of theirs.
    pub(super) fn weight(&self, direction: DVec3) -> f64 {
        let weights = self.normalized();
        let touches = |octant: &usize| {
            let sides = octant_center(*octant) * direction;
            sides.min_element() > -1e-9
        };
        let octants: Vec<_> = (0..8).filter(touches).collect();
        octants.iter().map(|&octant| f64::from(weights[octant])).sum::<f64>() / octants.len().max(1) as f64
    }
}

/// The middle of an octant, not of unit length.
fn octant_center(octant: usize) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|axis| if octant >> axis & 1 == 1 { 1.0 } else { -1.0 }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_have_the_weights_of_their_octants() {
        let sky = Sky([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
        assert!((sky.weight(DVec3::new(0.1, -0.2, 0.3)) - 6.0 / 4.5).abs() < 1e-6);
        // Along an axis: the four octants around it.
        assert!((sky.weight(DVec3::Z) - 6.5 / 4.5).abs() < 1e-6);
        assert_eq!(Sky::above(Vec3::Y).0, [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0]);
        assert_eq!(Sky::octant(3).normalized()[3], 8.0);
    }

    #[test]
    fn no_weights_are_weights_of_one() {
        for weights in [[0.0; 8], [-1.0; 8], [f32::NAN; 8]] {
            assert_eq!(Sky(weights).normalized(), [1.0; 8]);
        }
    }
}
