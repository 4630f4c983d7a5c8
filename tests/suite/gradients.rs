//! Transfer functions by gradient: what they show, and what their occlusion is.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{prelude::*, render::VolumeTexture};
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    exact::assert_exact,
    headless::different_pixels,
    integral::{Integral, View},
    scene::{IMAGE, TestScene, few_rays, folded_volume, volume_from},
    views::{ALL, FAR_SHARE, assert_shows_within, in_front, scene_of},
};

fn point(value: f32, color: [f32; 3], opacity: f32) -> ControlPoint {
    ControlPoint { value, color, opacity }
}

fn factor(gradient: f32, opacity: f32) -> GradientPoint {
    GradientPoint { gradient, opacity }
}

/// Red where the gradient is short, blue and fainter where it is long.
fn red_to_blue() -> TransferFunction {
    let ramp = |color, opacity| vec![point(10.0, color, 0.0), point(240.0, color, opacity)];
    let blue = PointsAtGradient { from: 0.0, to: 60.0, points: ramp([0.1, 0.3, 0.9], 0.15) };
    TransferFunction { points: ramp([0.9, 0.2, 0.1], 0.35), at_gradients: vec![blue], ..default() }
}

fn set_function(scene: &mut TestScene, function: TransferFunction) {
    let volume = scene.volume;
    let handle = scene.world().resource_mut::<Assets<TransferFunction>>().add(function);
    scene.world().get_mut::<VolumeTransferFunction>(volume).expect("a function").0 = handle;
    scene.settle();
}

#[test]
fn functions_of_the_gradient_draw_the_integral() {
    for spacing in [DVec3::ONE, DVec3::new(0.8, 1.0, 1.4)] {
        let volume = folded_volume(UVec3::new(18, 17, 16), spacing);
        for gradient_opacity in [vec![], vec![factor(5.0, 1.0), factor(70.0, 0.3)]] {
            let function = TransferFunction { gradient_opacity, ..red_to_blue() };
            let mut scene = scene_of(volume.clone(), function.clone(), ShadingMode::Solid);
            scene.settle();
            let integral = Integral::of(&volume, &function);
            let camera = scene.camera();
            let view = View::of(&mut scene, camera, IMAGE);
            // Filter weights of 8 bits make differences of samples coarser too: a quarter more than without them.
            assert_shows_within([0.75, FAR_SHARE], "by gradient", &scene, ALL, |pixel| {
                in_front(integral.pixel(&view, pixel))
            });
        }
    }
}

#[test]
fn functions_of_the_gradient_are_exact() {
    let spacing = DVec3::new(0.8, 1.0, 1.6);
    let volume = folded_volume(UVec3::new(34, 29, 26), spacing);
    let mut scene = TestScene::new(volume, red_to_blue(), few_rays(), ShadingMode::Cao);
    let carver = scene.carve(Cuboid::new(10.0, 8.0, 12.0), ClipMesh::default(), Transform::default());
    for x in [2.0, -3.0] {
        scene.move_carver(carver, Transform::from_xyz(x, 5.0, 6.0));
        assert_exact(&mut scene, "by gradient");
    }
}

#[test]
fn a_factor_is_a_factor() {
    let volume = folded_volume(UVec3::new(18, 17, 16), DVec3::ONE);
    let ramp = |opacity| TransferFunction::ramp(10.0, 240.0, opacity, [0.6, 0.8, 0.9]).expect("a ramp");
    let half = |gradients: &[f32]| TransferFunction {
        gradient_opacity: gradients.iter().map(|&gradient| factor(gradient, 0.5)).collect(),
        ..ramp(0.4)
    };
    let mut scene = TestScene::new(volume, ramp(0.2), few_rays(), ShadingMode::Cao);
    scene.settle();
    let (image, opacities) =
        (scene.headless.image(), scene.headless.voxels(scene.volume, VolumeTexture::Opacities));
    for function in [half(&[0.0]), half(&[3.0, 90.0])] {
        set_function(&mut scene, function);
        let of_factor = scene.headless.voxels(scene.volume, VolumeTexture::Opacities);
        let largest = opacities.iter().zip(&of_factor).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(largest <= Some(1), "opacities differ by {largest:?}");
        let largest = image.iter().zip(&scene.headless.image()).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(largest <= Some(2), "the image differs by {largest:?}");
    }
    // A factor of 1 is none, and costs nothing.
    let one = TransferFunction { gradient_opacity: vec![factor(0.0, 1.0), factor(9.0, 1.0)], ..ramp(0.2) };
    assert_eq!(one.last_gradient(), None);
    set_function(&mut scene, one);
    assert_eq!(different_pixels(&image, &scene.headless.image()), 0);
}

#[test]
fn gradients_per_voxel_follow_the_spacing() {
    // The mean distance is 2 mm.
    let volume = folded_volume(UVec3::new(18, 17, 16), DVec3::new(1.0, 2.0, 3.0));
    let function = |gradient_unit, scale: f32| {
        let ramp = TransferFunction::ramp(10.0, 240.0, 0.4, [0.6, 0.8, 0.9]).expect("a ramp");
        let gradient_opacity = vec![factor(5.0 * scale, 0.0), factor(20.0 * scale, 1.0)];
        TransferFunction { gradient_opacity, gradient_unit, ..ramp }
    };
    let per_voxel = function(GradientUnit::PerVoxel, 2.0);
    let mut scene = TestScene::new(volume, per_voxel.clone(), few_rays(), ShadingMode::Cao);
    scene.settle();
    let image = scene.headless.image();
    set_function(&mut scene, function(GradientUnit::PerMm, 1.0));
    assert_eq!(different_pixels(&image, &scene.headless.image()), 0, "the same function");
    set_function(&mut scene, function(GradientUnit::PerMm, 2.0));
    assert!(different_pixels(&image, &scene.headless.image()) > 500, "the unit has no effect");
    let ron = per_voxel.to_ron().expect("it is written");
    assert_eq!(TransferFunction::from_ron(&ron).expect("it is read"), per_voxel);
}

/// Pixels much redder than green.
fn red_pixels(scene: &TestScene) -> usize {
    let is_red = |pixel: &&[u8]| pixel[0] > 60 && f32::from(pixel[0]) > 1.8 * f32::from(pixel[1]);
    scene.headless.image().chunks(4).filter(is_red).count()
}

#[test]
fn no_seam_is_left_between_two_tissues() {
    // A dense ball in a faint one, and a rod of a density between the two: a vessel beside a bone.
    let volume = |has_rod| {
        volume_from(UVec3::splat(40), DVec3::ONE, |p| {
            let smooth = |inside: f64| (0.5 + inside / 3.0).clamp(0.0, 1.0);
            let rod = 20.0 * (0.2 - DVec3::new(p.x - 0.6, 0.0, p.z - 0.6).length());
            let ball = smooth(20.0 * (0.5 - p.length()));
            (0.1 + if has_rod { 0.3 * smooth(rod) } else { 0.0 }).max(0.1 + 0.9 * ball)
        })
    };
    const WHITE: [f32; 3] = [0.9; 3];
    const RED: [f32; 3] = [0.8, 0.05, 0.05];
    let of = |band| {
        let band = move |value, opacity| point(value, band, opacity);
        vec![band(60.0, 0.0), band(70.0, 1.0), band(130.0, 1.0), point(140.0, WHITE, 1.0)]
    };
    let by_value = TransferFunction { points: of(RED), ..default() };
    let white = PointsAtGradient { from: 30.0, to: 45.0, points: of(WHITE) };
    let by_gradient = TransferFunction { at_gradients: vec![white], ..by_value.clone() };
    let [ball, both] = [false, true].map(|has_rod| {
        let mut scene = TestScene::new(volume(has_rod), by_value.clone(), few_rays(), ShadingMode::Solid);
        scene.settle();
        let before = red_pixels(&scene);
        set_function(&mut scene, by_gradient.clone());
        [before, red_pixels(&scene)]
    });
    assert!(ball[0] > 300 && ball[1] == 0, "{} red pixels of the seam became {}", ball[0], ball[1]);
    assert!(both[0] > both[1] && both[1] > 200, "the rod keeps {} of {} red pixels", both[1], both[0]);
}

#[test]
fn points_for_gradients_are_kept_and_checked() {
    let function = red_to_blue();
    let written = function.to_ron().expect("it can be written");
    assert_eq!(TransferFunction::from_ron(&written).expect("it can be read"), function);
    let with = |from, to, points| {
        let at = PointsAtGradient { from, to, points };
        let error = TransferFunction { at_gradients: vec![at], ..red_to_blue() }.validate();
        error.expect_err("it is invalid").to_string()
    };
    let good = || vec![point(1.0, [0.0; 3], 0.5)];
    for (error, expected) in [
        (with(-1.0, 2.0, good()), "from is -1"),
        (with(3.0, 2.0, good()), "to is 2, must not be below"),
        (with(1.0, f32::NAN, good()), "to is NaN, must be finite"),
        (with(1.0, 5.0, vec![]), "at_gradients 0: there are no control points"),
        (with(1.0, 5.0, vec![point(1.0, [0.0; 3], 1.5)]), "at_gradients 0: control point 0: opacity is 1.5"),
    ] {
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn samples_lie_between_gradients() {
    let function =
        TransferFunction { gradient_opacity: vec![factor(20.0, 1.0), factor(40.0, 0.5)], ..red_to_blue() };
    assert_eq!(function.last_gradient(), Some(60.0));
    assert_eq!(function.sample_at(240.0, 0.0), [0.9, 0.2, 0.1, 0.35]);
    assert_eq!(function.sample_at(240.0, 0.0), function.sample(240.0));
    let [red, .., opacity] = function.sample_at(240.0, 30.0);
    assert!((red - 0.5).abs() < 1e-6 && (opacity - 0.75 * 0.25).abs() < 1e-6, "{red} {opacity}");
    let beyond = function.sample_at(240.0, 1e9);
    assert_eq!(beyond, [0.1, 0.3, 0.9, 0.075]);
    assert_eq!(function.sample_at(240.0, f32::NAN), function.sample(240.0));
}
