//! How bright pictures are: what a flat surface gets, and the settings of light.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::mode::ShadingMode;

use crate::scene::{TestScene, volume_from};

/// Grey of the scenes, sRGB.
const GREY: f32 = 0.6;

/// A block that fills the grid but for two voxels at its sides, opaque.
fn block(occlusion: AmbientOcclusion, mode: ShadingMode) -> TestScene {
    let block = volume_from(UVec3::splat(32), DVec3::ONE, |p| {
        let inside = 0.875 - p.abs().max_element();
        (0.5 + 16.0 * inside / 2.0).clamp(0.0, 1.0)
    });
    let function = TransferFunction::ramp(100.0, 155.0, 1.0, [GREY; 3]).expect("a valid ramp");
    let mut scene = TestScene::new(block, function, occlusion, mode);
    set_shading(&mut scene, |shading| shading.ambient_scale = AmbientScale::FlatSurface);
    scene
}

fn set_shading(scene: &mut TestScene, set: impl Fn(&mut VolumeShading)) {
    let volume = scene.volume;
    set(&mut scene.world().get_mut::<VolumeShading>(volume).expect("shading"));
    scene.settle();
}

/// Linear light of the pixel in the image's middle: the middle of the block's front.
fn light_of_front(scene: &TestScene) -> f32 {
    let image = scene.headless.image();
    let pixels = image.len() / 4;
    let size = (pixels as f64).sqrt() as usize;
    let pixel = &image[4 * (size / 2 * size + size / 2)..];
    LinearRgba::from(Srgba::rgb_u8(pixel[0], pixel[1], pixel[2])).red
}

/// Linear light of the grey.
fn full_light() -> f32 {
    LinearRgba::from(Srgba::rgb(GREY, GREY, GREY)).red
}

#[test]
fn a_flat_surface_gets_all_of_the_light() {
    let full = full_light();
    let rays = |steps, step_mm| OcclusionRays { steps, step_mm: Some(step_mm), ..default() };
    for rays in [default(), rays(10, 1.0), rays(20, 2.0)] {
        let mut scene = block(AmbientOcclusion::by(rays), ShadingMode::Cao);
        let light = light_of_front(&scene) / full;
        // Half a byte is 0.6 % of the light; occlusion has bytes of 0.4 %, here twice that. A spline blurs this edge of a
        // voxel, so that occlusion is looked up a twentieth of a voxel deeper: 2 %.
        assert!((0.95..1.01).contains(&light), "{rays:?}: {light} of the light");
        set_shading(&mut scene, |shading| shading.ambient_scale = AmbientScale::Published);
        let published = light_of_front(&scene) / full;
        assert!((0.35..0.6).contains(&published), "{rays:?}: {published} as published");
    }
}

#[test]
fn exposure_and_intensity_scale_light_and_shadows() {
    let mut scene = block(default(), ShadingMode::Cao);
    set_shading(&mut scene, |shading| shading.ambient_scale = AmbientScale::Published);
    let published = light_of_front(&scene);
    set_shading(&mut scene, |shading| shading.exposure = 1.5);
    let brighter = light_of_front(&scene);
    assert!((brighter / published - 1.5).abs() < 0.03, "{published} became {brighter}");
    set_shading(&mut scene, |shading| (shading.exposure, shading.occlusion_intensity) = (1.0, 2.0));
    let full = full_light();
    let darker = light_of_front(&scene) / full;
    assert!((darker - (published / full).powi(2)).abs() < 0.02, "{published} became {darker}");
    set_shading(&mut scene, |shading| shading.occlusion_intensity = 0.0);
    assert!((light_of_front(&scene) / full - 1.0).abs() < 0.01, "no shadow is left");
    for invalid in [f32::NAN, -1.0, f32::INFINITY] {
        set_shading(&mut scene, |shading| {
            (shading.exposure, shading.occlusion_intensity) = (invalid, invalid)
        });
    }
}
