//! Every way to shade samples, against the volume rendering integral.

use bevy::math::DVec3;
use bevy_contextual_ao::{prelude::*, render::VolumeTexture};
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    field::Field,
    integral::{Integral, Sample, View},
    scene::{IMAGE, volume_from},
    views::{ALL, FAR_SHARE, SIZE, SPACING, assert_shows_within, in_front, scene_of},
};

/// Blinn-Phong as documented, with a light at the camera.
pub fn blinn_phong(color: DVec3, facing: f64, ambient: f64) -> DVec3 {
    color * (0.3 + 0.7 * facing) * ambient + 0.2 * facing.powi(16)
}

#[test]
fn every_mode_shades_the_integral() {
    // Intensity falls steadily from the centre outwards, so that normals are known.
    let volume = volume_from(SIZE, SPACING, |p| 1.0 - (p * SPACING * SIZE.as_dvec3() / 24.0).length());
    let function = TransferFunction::ramp(30.0, 220.0, 0.8, [0.6, 0.8, 0.9]).expect("a valid ramp");
    let mut scene = scene_of(volume.clone(), function.clone(), ShadingMode::Solid);
    for mode in ShadingMode::ALL {
        scene.set_mode(mode);
        scene.settle();
        let factors = Field::of_bytes(SIZE, scene.headless.voxels(scene.volume, VolumeTexture::Occlusion));
        let shade = |sample: &Sample| {
            let facing = (sample.local.normalize().dot(sample.direction)).abs();
            let factor = factors.at(sample.voxel);
            match mode {
                ShadingMode::Solid => sample.color,
                ShadingMode::Phong => blinn_phong(sample.color, facing, 1.0),
                ShadingMode::Cao | ShadingMode::Lao => sample.color * factor,
                _ => blinn_phong(sample.color, facing, factor),
            }
        };
        let integral = Integral { shade: &shade, ..Integral::of(&volume, &function) };
        let camera = scene.camera();
        let view = View::of(&mut scene, camera, IMAGE);
        // Intensities change by 10 bytes a voxel, so that rounding them turns normals by a degree.
        let most_mean = if mode.uses_light() { 0.9 } else { 0.6 };
        let expected = |pixel| in_front(integral.pixel(&view, pixel));
        assert_shows_within([most_mean, FAR_SHARE], mode.name(), &scene, ALL, expected);
    }
}
