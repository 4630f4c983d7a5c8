//! Monte Carlo of directional occlusion shading's own definition (Schott et al. 2009, equations 7 to 10; figure 2): along
//! a view ray, matter scatters the share of a cone towards the viewer from which light arrives.

use bevy::math::DVec3;
use bevy_contextual_ao::prelude::TransferFunction;

use super::field::{Eye, Field, spiral};

/// Rays in a cone.
const RAYS: u32 = 96;
/// Distance of samples along rays, voxels.
const STEP: f64 = 0.5;
/// Light below this share counts as none.
const DARK: f64 = 1.0 / 512.0;

/// Opacities of a volume.
pub struct Matter<'a> {
    pub field: &'a Field,
    pub function: &'a TransferFunction,
}

impl Matter<'_> {
    /// Opacity of a step.
    fn opacity(&self, p: DVec3) -> f64 {
        let opacity = f64::from(self.function.sample(self.field.at(p) as f32)[3]);
        let length = STEP * self.field.voxel_mm / f64::from(self.function.opacity_unit_distance_mm);
        1.0 - (1.0 - opacity).powf(length)
    }

    /// Light that reaches the eye from a direction, for white matter in white light; `None` where no matter is seen.
    pub fn light_at(&self, eye: &Eye, direction: DVec3, aperture_degrees: f64) -> Option<f64> {
        let [mut along, end] = self.field.bounds(eye.origin, direction);
        let step = STEP * self.field.voxel_mm;
        let (mut light, mut transmittance) = (0.0, 1.0);
        while along < end && transmittance > DARK {
            let p = eye.origin + along * direction;
            let opacity = self.opacity(p);
            if opacity > 0.0 {
                light += transmittance * opacity * self.visible(p, -direction, aperture_degrees);
                transmittance *= 1.0 - opacity;
            }
            along += step;
        }
        (transmittance < 0.5).then_some(light)
    }

    /// Fraction visible (equation 10): the mean transmittance of the rays in a cone.
    fn visible(&self, p: DVec3, axis: DVec3, aperture_degrees: f64) -> f64 {
        let lowest = aperture_degrees.to_radians().cos();
        let sum: f64 = (0..RAYS)
            .map(|k| {
                let cosine = 1.0 - (1.0 - lowest) * (f64::from(k) + 0.5) / f64::from(RAYS);
                self.transmittance(p, spiral(axis, k, cosine))
            })
            .sum();
        sum / f64::from(RAYS)
    }

    fn transmittance(&self, from: DVec3, ray: DVec3) -> f64 {
        let step = STEP * self.field.voxel_mm * ray;
        // The matter that scatters does not shade itself.
        let (mut p, mut light) = (from + step, 1.0);
        while light > DARK && self.field.contains(p) {
            light *= 1.0 - self.opacity(p);
            p += step;
        }
        if light > DARK { light } else { 0.0 }
    }
}
