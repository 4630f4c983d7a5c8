//! Intensities between voxels, and their gradient: the filters of `reconstruction.wgsl` in double precision.

use bevy::math::{DVec3, I64Vec3};

use crate::volume::{Intensities, Volume};

/// The stored intensities of a volume at any place. Places are in voxels, whole numbers at voxel centres.
pub(super) struct Field<'a> {
    intensities: &'a Intensities,
    last: I64Vec3,
    is_tricubic: bool,
}

impl<'a> Field<'a> {
    pub fn new(volume: &'a Volume, is_tricubic: bool) -> Self {
        let last = volume.dimensions().as_i64vec3() - 1;
        Self { intensities: volume.intensities(), last, is_tricubic }
    }

    /// Intensity by the filter of view rays.
    pub fn at(&self, place: DVec3) -> f64 {
        if !self.is_tricubic {
            return self.trilinear(place);
        }
        let (first, f) = split(place);
        self.sum(first.saturating_sub(I64Vec3::ONE), f.to_array().map(spline))
    }

    pub fn trilinear(&self, place: DVec3) -> f64 {
        let (first, f) = split(place);
        self.sum(first, f.to_array().map(|f| [1.0 - f, f]))
    }

    /// Gradient per voxel by differences over a voxel to either side, as `trilinear_around`.
    pub fn differences(&self, place: DVec3) -> DVec3 {
        let along = |axis: DVec3| 0.5 * (self.trilinear(place + axis) - self.trilinear(place - axis));
        DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z))
    }

    /// Gradient of the cubic B-spline, per voxel.
    pub fn gradient(&self, place: DVec3) -> DVec3 {
        let (first, f) = split(place);
        let weights = f.to_array().map(spline);
        let slopes = f.to_array().map(spline_slope);
        let along = |axis: usize| {
            let mut mixed = weights;
            mixed[axis] = slopes[axis];
            self.sum(first.saturating_sub(I64Vec3::ONE), mixed)
        };
        DVec3::new(along(0), along(1), along(2))
    }

    /// Weighted sum of successive voxels along each axis. Beyond the grid its outermost voxels go on.
    fn sum<const N: usize>(&self, first: I64Vec3, [x, y, z]: [[f64; N]; 3]) -> f64 {
        let places = |axis: usize| -> [i64; N] {
            let last = self.last[axis];
            core::array::from_fn(|k| first[axis].saturating_add(k as i64).max(0).min(last))
        };
        let [columns, rows, slices] = [places(0), places(1), places(2)];
        let (width, height) = (self.last.x + 1, self.last.y + 1);
        let mut sum = 0.0;
        for k in 0..N {
            for j in 0..N {
                let row = (slices[k] * height + rows[j]) * width;
                let mut along = 0.0;
                for i in 0..N {
                    along += x[i] * f64::from(self.intensities.get((row + columns[i]) as usize).unwrap_or(0));
                }
                sum += z[k] * y[j] * along;
            }
        }
        sum
    }
}

/// The voxel before a place along each axis, and how far the place is behind it.
fn split(place: DVec3) -> (I64Vec3, DVec3) {
    let first = place.floor();
    (first.as_i64vec3(), place - first)
}

/// Weights of 4 successive voxels at a place `f` behind the second.
fn spline(f: f64) -> [f64; 4] {
    let g = 1.0 - f;
    [g * g * g, 4.0 - 3.0 * f * f * (2.0 - f), 4.0 - 3.0 * g * g * (2.0 - g), f * f * f].map(|w| w / 6.0)
}

/// Derivatives of these weights.
fn spline_slope(f: f64) -> [f64; 4] {
    let g = 1.0 - f;
    [-g * g, f * (3.0 * f - 4.0), g * (4.0 - 3.0 * g), f * f].map(|w| 0.5 * w)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Rescale;
    use bevy::math::{DAffine3, UVec3};

    /// Values that are linear in the place.
    fn ramp() -> Volume {
        let value = |k: usize| (10 + 3 * (k % 6) + 5 * (k / 6 % 5) + 7 * (k / 30)) as u8;
        let intensities = Intensities::U8((0..120).map(value).collect());
        Volume::new(UVec3::new(6, 5, 4), DAffine3::IDENTITY, intensities, Rescale::default())
            .expect("a volume")
    }

    #[test]
    fn a_ramp_is_itself_by_every_filter() {
        let volume = ramp();
        for is_tricubic in [false, true] {
            let field = Field::new(&volume, is_tricubic);
            for place in [DVec3::new(2.0, 2.0, 1.0), DVec3::new(2.3, 1.9, 1.6)] {
                let expected = 10.0 + place.dot(DVec3::new(3.0, 5.0, 7.0));
                assert!((field.at(place) - expected).abs() < 1e-9, "{place}");
                for gradient in [field.differences(place), field.gradient(place)] {
                    let is_ramp = gradient.abs_diff_eq(DVec3::new(3.0, 5.0, 7.0), 1e-9);
                    // The filters reach beyond the last slice from here.
                    assert!(is_ramp || place.z > 1.5, "{gradient} at {place}");
                }
            }
        }
    }

    #[test]
    fn places_outside_have_the_nearest_intensity() {
        let volume = ramp();
        let field = Field::new(&volume, false);
        assert_eq!(field.at(DVec3::splat(-9.0)), 10.0);
        assert_eq!(field.at(DVec3::new(99.0, 4.0, 3.0)), 10.0 + 15.0 + 20.0 + 21.0);
        assert!(field.at(DVec3::NAN).is_nan() && field.at(DVec3::INFINITY).is_nan());
    }
}
