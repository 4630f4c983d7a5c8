//! Bevy's anti-aliasing in views of volumes: over frames (TAA), and of pictures (FXAA).

use bevy::{
    anti_alias::{fxaa::Fxaa, taa::TemporalAntiAliasing},
    math::DVec3,
    prelude::*,
    render::camera::TemporalJitter,
};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    integral::{Integral, View, srgb_byte},
    outlines::{carved, error_at, outline_of, volume},
    scene::{IMAGE, TestScene, in_world_units, translucent_ramp},
    views,
};

/// A solid volume that a turned box carves, in a view with one sample a pixel.
fn without_samples() -> TestScene {
    let (mut scene, _) = carved(&volume(), ShadingMode::Solid);
    let camera = scene.camera();
    scene.world().entity_mut(camera).insert(Msaa::Off);
    scene.headless.frame();
    scene
}

/// The same with anti-aliasing over frames, some of which have been drawn.
fn over_frames() -> TestScene {
    let mut scene = without_samples();
    let camera = scene.camera();
    scene.world().entity_mut(camera).insert(TemporalAntiAliasing::default());
    scene.headless.frames(16);
    scene
}

/// Mean errors at outlines, bytes: of the image, and of one without anti-aliasing.
fn errors(scene: &mut TestScene, shift_mm: DVec3) -> [f64; 2] {
    let outline = outline_of(scene, &volume(), shift_mm);
    let error = error_at(&outline, scene);
    let camera = scene.camera();
    scene.world().entity_mut(camera).remove::<(TemporalAntiAliasing, TemporalJitter, Fxaa)>();
    scene.headless.frames(2);
    [error, error_at(&outline, scene)]
}

#[test]
fn a_picture_is_smoothed() {
    let mut scene = without_samples();
    let camera = scene.camera();
    scene.world().entity_mut(camera).insert(Fxaa::default());
    scene.headless.frames(2);
    let [smoothed, alone] = errors(&mut scene, DVec3::ZERO);
    println!("off by {smoothed:.1} bytes, without FXAA by {alone:.1}");
    assert!(smoothed < 0.7 * alone, "off by {smoothed} bytes, without FXAA by {alone}");
}

#[test]
fn frames_converge_to_a_supersampled_picture() {
    let mut scene = over_frames();
    scene.headless.frames(32);
    let [converged, alone] = errors(&mut scene, DVec3::ZERO);
    println!("off by {converged:.1} bytes, without TAA by {alone:.1}");
    assert!(converged < 0.4 * alone, "off by {converged} bytes, without TAA by {alone}");
}

// Without motion vectors, the images of the next two tests are off by three times as much as ones without anti-aliasing. With
// them but without depths, by twice as much: Bevy takes the motion of the nearest of neighbouring pixels.

#[test]
fn a_view_that_turns_leaves_no_ghosts() {
    let mut scene = over_frames();
    let camera = scene.camera();
    for _ in 0..16 {
        let mut place = scene.world().get_mut::<Transform>(camera).expect("a place");
        place.rotate_around(Vec3::ZERO, Quat::from_rotation_y(0.005));
        scene.headless.frame();
    }
    let [moving, alone] = errors(&mut scene, DVec3::ZERO);
    println!("off by {moving:.1} bytes, without TAA by {alone:.1}");
    // 13.8 and 13.3. Silhouettes do not keep their place on what turns.
    assert!(moving < 1.5 * alone, "off by {moving} bytes, without TAA by {alone}");
}

#[test]
fn a_volume_that_moves_leaves_no_ghosts() {
    let mut scene = over_frames();
    let mut shift = DVec3::ZERO;
    for _ in 0..16 {
        shift.y += 0.25;
        let place = in_world_units(Transform::from_translation(shift.as_vec3()));
        scene.place_volume(place.with_scale(Vec3::ONE));
        scene.headless.frame();
    }
    let [moving, alone] = errors(&mut scene, shift);
    println!("off by {moving:.1} bytes, without TAA by {alone:.1}");
    assert!(moving < alone, "off by {moving} bytes, without TAA by {alone}");
}

#[test]
fn noise_averages_out_over_frames() {
    let mut scene = views::scene_of(views::volume(), translucent_ramp(), ShadingMode::Solid);
    let entity = scene.volume;
    let mut shading = scene.world().get_mut::<VolumeShading>(entity).expect("shading");
    (shading.step_voxels, shading.jitter) = (4.0, true);
    scene.settle();
    let integral = Integral::of(&views::volume(), &translucent_ramp());
    let camera = scene.camera();
    let view = View::of(&mut scene, camera, IMAGE);
    let pixels = (0..IMAGE.element_product()).map(|index| UVec2::new(index % IMAGE.x, index / IMAGE.x));
    let expected: Vec<_> = pixels.map(|pixel| integral.pixel(&view, pixel)).collect();
    // Standard deviation of a pixel's error from its neighbours', bytes.
    let grain = |scene: &TestScene| {
        let image = scene.headless.image();
        let error =
            |index: usize| f64::from(image[4 * index + 1]) - srgb_byte(views::in_front(expected[index]).y);
        let row = IMAGE.x as usize;
        let inner = (row..expected.len() - row).filter(|index| expected[*index].transmittance < 0.5);
        let grain = inner.map(|k| {
            let around = [k - 1, k + 1, k - row, k + row].map(error);
            (error(k) - around.iter().sum::<f64>() / 4.0).powi(2)
        });
        let grain: Vec<f64> = grain.collect();
        assert!(grain.len() > 500, "{} pixels", grain.len());
        (grain.iter().sum::<f64>() / grain.len() as f64).sqrt()
    };
    let alone = grain(&scene);
    scene.world().entity_mut(camera).insert(TemporalAntiAliasing::default());
    scene.headless.frames(48);
    let averaged = grain(&scene);
    println!("grain {averaged:.2} bytes, of one frame {alone:.2}");
    // The same noise in all frames leaves 0.86 of it.
    assert!(averaged < 0.7 * alone, "grain {averaged} bytes, of one frame {alone}");
}
