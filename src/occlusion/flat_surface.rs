//! Occlusion of an open flat surface: the most that a surface gets, unless it bulges.

use super::Sky;

/// Share of the directions of an octant on the side of another octant's middle, by the number of axes along which the two
/// differ: 1 - P(x > y + z) for one axis, of even directions with all coordinates above 0.
const OCTANT_SHARES: [f64; 4] = [1.0, 0.7844, 0.2156, 0.0];
/// Number of angles to the surface that the mean is taken over.
const ANGLES: u32 = 64;
/// Half the width of the layer in which interpolated opacities grow from 0 to 1, voxels.
const HALF_LAYER: f64 = 1.0;

/// Mean factor of rays from an opaque half space's surface. Samples are `step` voxels apart, the first one at `start`
/// voxels. The surface faces most of the sky.
pub(super) fn flat_factor(steps: u32, start: f64, step: f64, sky: &Sky) -> f64 {
    let [mut outwards, mut inwards] = [0.0; 2];
    for k in 0..ANGLES {
        // Even directions have even cosines.
        let cosine = (f64::from(k) + 0.5) / f64::from(ANGLES);
        outwards += ray_factor(steps, start * cosine, step * cosine) / f64::from(ANGLES);
        inwards += ray_factor(steps, -start * cosine, -step * cosine) / f64::from(ANGLES);
    }
    let facing = share_of_sky(sky);
    facing * outwards + (1.0 - facing) * inwards
}

/// Factor of a ray by the heights of its samples above the surface, voxels.
fn ray_factor(steps: u32, first: f64, step: f64) -> f64 {
    let (mut transmittance, mut sum) = (1.0, 1.0);
    for k in 0..steps {
        let height = first + f64::from(k) * step;
        transmittance *= 1.0 - (0.5 - 0.5 * height / HALF_LAYER).clamp(0.0, 1.0);
        // Nothing changes any more above the layer, or in the dark.
        if height > HALF_LAYER || transmittance == 0.0 {
            sum += transmittance * f64::from(steps - k);
            break;
        }
        sum += transmittance;
    }
    sum / (f64::from(steps) + 1.0)
}

/// Share of the sky's light that comes from the side of a surface; the largest of 14 ways in which it may face.
fn share_of_sky(sky: &Sky) -> f64 {
    let weights = sky.normalized().map(f64::from);
    let share = |of_octant: &dyn Fn(usize) -> f64| {
        weights.iter().enumerate().map(|(octant, weight)| weight * of_octant(octant)).sum::<f64>() / 8.0
    };
    let along_axis =
        (0..6).map(|side| share(&|octant| f64::from(u8::from(octant >> (side / 2) & 1 == side % 2))));
    let towards = |middle: usize| move |octant: usize| OCTANT_SHARES[(octant ^ middle).count_ones() as usize];
    let to_octant = (0..8).map(|middle| share(&towards(middle)));
    along_axis.chain(to_octant).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::prelude::Vec3;

    #[test]
    fn a_surface_faces_what_light_there_is() {
        assert!((share_of_sky(&Sky::default()) - 0.5).abs() < 1e-3);
        assert_eq!(share_of_sky(&Sky::above(Vec3::Y)), 1.0);
        assert_eq!(share_of_sky(&Sky::octant(5)), 1.0);
    }

    #[test]
    fn half_of_the_rays_see_the_sky_but_for_grazing_ones() {
        let factor = |steps, sky: &Sky| flat_factor(steps, 3.0f64.sqrt(), 1.0, sky);
        // Without samples nothing is occluded.
        assert_eq!(factor(0, &Sky::default()), 1.0);
        // Computed apart, with 100,000 angles: 0.7733 outwards, 0.0570 inwards. 64 angles miss them by less than 0.001.
        let (even, above) = (factor(20, &Sky::default()), factor(20, &Sky::above(Vec3::Y)));
        assert!((above - 0.7733).abs() < 1e-3, "{above}");
        assert!((even - 0.5 * (0.7733 + 0.0570)).abs() < 1e-3, "{even}");
        // Longer rays are darker inwards only.
        assert!(factor(200, &Sky::default()) < even);
    }
}
