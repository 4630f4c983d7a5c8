//! The GPU's local ambient occlusion against its definition, evaluated in double precision.

use bevy::{
    math::{DMat4, DVec3},
    prelude::*,
};
use bevy_contextual_ao::{
    occlusion::VoxelOpacities, prelude::*, render::VolumeTexture, volume::VolumeGeometry,
};
use contextual_ao_kit::mode::ShadingMode;

use crate::headless::voxel_at;
use crate::scene::{TestScene, folded_volume, opaque_ramp, translucent_ramp};

/// Opacities per voxel as the renderer stores them, zero-padded, trilinear in between.
struct Oracle {
    dimensions: UVec3,
    opacities: Vec<f64>,
    geometry: VolumeGeometry,
}

impl Oracle {
    fn at_voxel(&self, index: [i64; 3]) -> f64 {
        let size = self.dimensions.to_array().map(i64::from);
        if (0..3).any(|axis| index[axis] < 0 || index[axis] >= size[axis]) {
            return 0.0;
        }
        self.opacities[((index[2] * size[1] + index[1]) * size[0] + index[0]) as usize]
    }

    fn opacity(&self, voxel: DVec3) -> f64 {
        let base = voxel.floor();
        let fraction = voxel - base;
        (0..8)
            .map(|corner| {
                let far = [0, 1, 2].map(|axis| (corner >> axis) & 1);
                let index = [0, 1, 2].map(|axis| base[axis] as i64 + far[axis]);
                let weight = |axis: usize| {
                    if far[axis] == 1 { fraction[axis] } else { 1.0 - fraction[axis] }
                };
                weight(0) * weight(1) * weight(2) * self.at_voxel(index)
            })
            .sum()
    }

    /// Occlusion factor by DESIGN's definition: equations 2 and 3 of the paper.
    fn ambient(&self, voxel: DVec3, occlusion: &AmbientOcclusion) -> f64 {
        let voxel_from_local = DMat4::from(self.geometry.local_from_voxel).inverse();
        let start = self.geometry.spacing_mm.length();
        let settings = occlusion.method.rays().expect("rays");
        let steps = settings.steps;
        let step_mm = occlusion.step_length_mm(&self.geometry);
        let rays = settings.directions(&occlusion.sky);
        rays.iter()
            .map(|ray| {
                let direction = voxel_from_local.transform_vector3(ray.direction);
                let (mut transmittance, mut sum) = (1.0, 1.0);
                for i in 0..steps {
                    let distance = start + i as f64 * step_mm;
                    transmittance *= 1.0 - self.opacity(voxel + direction * distance);
                    sum += transmittance;
                }
                ray.weight * sum / (steps + 1) as f64
            })
            .sum()
    }
}

fn check(dimensions: UVec3, spacing: DVec3, function: TransferFunction, occlusion: AmbientOcclusion) {
    let occlusion = AmbientOcclusion { opacities: VoxelOpacities::OfCenters, ..occlusion };
    let volume = folded_volume(dimensions, spacing);
    let geometry = VolumeGeometry::of(&volume);
    // Defined opacities: the transfer function at the voxel, corrected for the step. The renderer stores them in a
    // byte.
    let exponent = occlusion.step_length_mm(&geometry) / f64::from(function.opacity_unit_distance_mm);
    let mut defined = Vec::new();
    for z in 0..dimensions.z {
        for y in 0..dimensions.y {
            for x in 0..dimensions.x {
                let value = volume.value_at(UVec3::new(x, y, z)).unwrap_or_default();
                let opacity = function.sample(value as f32)[3] as f64;
                defined.push(1.0 - (1.0 - opacity).powf(exponent));
            }
        }
    }
    let mut scene = TestScene::new(volume, function, occlusion.clone(), ShadingMode::Lao);
    scene.settle();
    let stored = scene.opacities();
    for (defined, stored) in defined.iter().zip(&stored) {
        // Half a byte is rounding. The rest is a table entry's slope: 1/4095 of the ramp either way.
        let difference = (defined * 255.0 - *stored as f64).abs();
        assert!(difference <= 0.5 + 0.1, "opacity {defined}, stored {stored}");
    }
    let oracle =
        Oracle { dimensions, opacities: stored.iter().map(|&byte| byte as f64 / 255.0).collect(), geometry };
    let found = scene.headless.voxels(scene.volume, VolumeTexture::Occlusion);
    // At half resolution, rays start at the middle of 2x2x2 voxels.
    let rays = occlusion.method.rays().expect("rays");
    let stride = if rays.resolution == OcclusionResolution::Half { 2 } else { 1 };
    let texels = (dimensions + (stride - 1)) / stride;
    assert_eq!(found.len(), texels.element_product() as usize);
    let (mut largest, mut squares) = (0f64, 0.0);
    for (index, found) in (0..).zip(&found) {
        let middle = f64::from(stride) * voxel_at(index, texels).as_dvec3() + 0.5 * f64::from(stride - 1);
        let error = (*found as f64 / 255.0 - oracle.ambient(middle, &occlusion)).abs();
        largest = largest.max(error);
        squares += error * error;
    }
    let rms = (squares / found.len() as f64).sqrt();
    println!("{dimensions} {} steps {}: largest {largest:.5}, rms {rms:.5}", rays.pattern, rays.steps);
    // A byte is rounded by up to half of 1/255. The filter's weights have 8 fractional bits. A sample is therefore
    // off by up to 3/512 of the differences between its 8 neighbours. These errors have either sign, and mostly
    // cancel over the samples of all rays. Together, the errors are at most 1.5 bytes.
    assert!(largest <= 1.5 / 255.0, "largest error {largest}");
    // Rounding alone gives 1/255/sqrt(12) = 0.00113.
    assert!(rms <= 0.0013, "rms {rms}");
}

#[test]
fn lao_is_as_defined_for_all_patterns() {
    let patterns = [
        RayPattern::Neighborhood6,
        RayPattern::Neighborhood14,
        RayPattern::Neighborhood26,
        RayPattern::Rubik54,
        RayPattern::Fibonacci(17),
    ];
    for pattern in patterns {
        let occlusion =
            AmbientOcclusion::by(OcclusionRays { pattern, steps: 9, step_mm: Some(1.0), ..default() });
        check(UVec3::new(15, 13, 10), DVec3::ONE, opaque_ramp(), occlusion);
    }
}

#[test]
fn lao_is_as_defined_for_anisotropic_spacing_and_long_steps() {
    let pattern = RayPattern::Fibonacci(26);
    let rays = OcclusionRays { pattern, steps: 6, step_mm: Some(1.7), ..default() };
    let spacing = DVec3::new(0.7, 1.1, 2.5);
    check(UVec3::new(18, 11, 7), spacing, translucent_ramp(), AmbientOcclusion::by(rays));
}

#[test]
fn lao_is_as_defined_for_512_rays_no_steps_and_one_ray() {
    let size = UVec3::new(8, 7, 9);
    for (pattern, steps) in
        [(RayPattern::Sphere512, 5), (RayPattern::Fibonacci(3), 0), (RayPattern::Fibonacci(1), 4)]
    {
        let occlusion =
            AmbientOcclusion::by(OcclusionRays { pattern, steps, step_mm: Some(1.0), ..default() });
        check(size, DVec3::ONE, translucent_ramp(), occlusion);
    }
}

#[test]
fn lao_is_as_defined_at_half_resolution_and_under_a_cloudy_sky() {
    let rays = OcclusionRays { pattern: RayPattern::Fibonacci(26), steps: 7, ..default() };
    let half = AmbientOcclusion::by(OcclusionRays { resolution: OcclusionResolution::Half, ..rays });
    check(UVec3::new(15, 12, 9), DVec3::ONE, opaque_ramp(), half.clone());
    check(UVec3::new(9, 12, 15), DVec3::new(1.2, 0.8, 1.0), translucent_ramp(), half);
    let above = Sky::above(Vec3::Y);
    assert!(rays.directions(&above).len() <= rays.pattern.directions().len() / 2 + 2, "no light, no rays");
    let under = |sky| AmbientOcclusion { sky, ..AmbientOcclusion::by(rays) };
    check(UVec3::new(13, 12, 11), DVec3::ONE, opaque_ramp(), under(above));
    let uneven = Sky([0.0, 1.0, 2.0, 0.5, 0.0, 3.0, 1.0, 0.0]);
    check(UVec3::new(8, 9, 10), DVec3::ONE, translucent_ramp(), under(uneven));
}
