//! Table of the rays around a voxel.

use bevy::{math::DVec3, prelude::*};

use crate::{
    occlusion::{AmbientOcclusion, OcclusionRays, ProgressiveRays},
    volume::VolumeGeometry,
};

/// Entries of a ray.
pub(super) const ENTRIES: usize = 3;

/// Table of the rays as the ray cast reads them, with [`ENTRIES`] for each. The first entry is the offset of the first
/// sample with the weight, the second the step between samples, both in texture coordinates. The third has steps per
/// voxel along each axis, 0 along an axis that the ray does not move along. Progressive rays are ordered so that the
/// first ones go in all directions.
pub(crate) fn ray_table(occlusion: &AmbientOcclusion, geometry: &VolumeGeometry) -> Vec<Vec4> {
    let Some(settings) = occlusion.method.rays() else { return default() };
    let texture_from_local = geometry.texture_from_voxel() * geometry.local_from_voxel.inverse();
    let start = OcclusionRays::start_mm(geometry.spacing_mm);
    let step = occlusion.step_length_mm(geometry);
    let to_texture = |v: DVec3| texture_from_local.transform_vector3(v).as_vec3();
    let voxels = geometry.dimensions.as_vec3();
    let mut rays = settings.directions(&occlusion.sky);
    if occlusion.method.get::<ProgressiveRays>().is_some() {
        rays = spread(rays);
    }
    rays.into_iter()
        .flat_map(|ray| {
            let of_step = to_texture(ray.direction * step);
            let inverse = (of_step * voxels)
                .to_array()
                .map(|voxels| if voxels.abs() < 1e-6 { 0.0 } else { 1.0 / voxels });
            [
                to_texture(ray.direction * start).extend(ray.weight as f32),
                of_step.extend(0.0),
                Vec3::from(inverse).extend(0.0),
            ]
        })
        .collect()
}

/// Moves neighbours in a list far from each other. Successive elements of the result were about a golden section of
/// the list apart, chosen so that each element comes once.
fn spread<T: Copy>(list: Vec<T>) -> Vec<T> {
    let count = list.len();
    let golden = (0.618 * count as f64).round() as usize;
    let stride = (golden..).find(|&stride| greatest_divisor(stride, count) == 1).unwrap_or(1);
    (0..count).map(|k| list[k * stride % count]).collect()
}

/// The greatest common divisor.
fn greatest_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreading_keeps_everything() {
        for count in 0..60 {
            let mut spread = spread((0..count).collect());
            spread.sort_unstable();
            assert_eq!(spread, (0..count).collect::<Vec<_>>());
        }
        assert_eq!(spread(vec![0, 1, 2, 3, 4]), [0, 3, 1, 4, 2]);
    }
}
