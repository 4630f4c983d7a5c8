//! The picture against the data: reconstruction, classification along the ray, normals and opacities of voxels.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{
    occlusion::{OcclusionResolution, VoxelOpacities},
    prelude::*,
};
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    exact::{assert_exact, assert_images_are_exact},
    headless::voxel_at,
    integral::Integral,
    scene::{TestScene, few_rays, folded_volume, in_world_units, opaque_ramp, translucent_ramp, volume_from},
    views::{check, scene_of},
};

/// Voxels of the ball's grid along each side, and its radius.
const BALL: u32 = 40;
const RADIUS: f64 = 15.0;

/// A ball whose edge is as wide as a scanner makes it: a normal distribution of 0.9 voxels, close to a logistic one.
fn ball() -> Volume {
    volume_from(UVec3::splat(BALL), DVec3::ONE, |p| {
        let inside = RADIUS - 0.5 * f64::from(BALL) * p.length();
        1.0 / (1.0 + (-1.702 * inside / 0.9).exp())
    })
}

fn set_shading(scene: &mut TestScene, set: impl Fn(&mut VolumeShading)) {
    let volume = scene.volume;
    set(&mut scene.world().get_mut::<VolumeShading>(volume).expect("shading"));
}

/// Largest difference of two images, and the mean one, levels.
fn difference(a: &[u8], b: &[u8]) -> (u8, f64) {
    let differences = a.iter().zip(b).map(|(a, b)| a.abs_diff(*b));
    let sum: f64 = differences.clone().map(f64::from).sum();
    (differences.max().unwrap_or(0), sum / a.len() as f64)
}

/// A translucent ramp whose colour changes with the intensity.
fn colorful_ramp() -> TransferFunction {
    let points = [
        (10.0, 0.0, [0.9, 0.2, 0.1]),
        (90.0, 0.12, [0.9, 0.8, 0.1]),
        (160.0, 0.23, [0.1, 0.8, 0.3]),
        (240.0, 0.35, [0.2, 0.3, 0.9]),
    ];
    let points = points.map(|(value, opacity, color)| ControlPoint { value, color, opacity });
    TransferFunction::new(points.to_vec(), 1.0).expect("a valid ramp")
}

#[test]
fn all_filters_draw_the_integral() {
    let volume = folded_volume(UVec3::new(18, 17, 16), DVec3::ONE);
    let function = colorful_ramp();
    let mut scene = scene_of(volume.clone(), function.clone(), ShadingMode::Solid);
    let mut integral = Integral::of(&volume, &function);
    let images = Reconstruction::ALL.map(|filter| {
        set_shading(&mut scene, |shading| shading.reconstruction = filter);
        scene.settle();
        integral.filter = filter;
        check(filter.name(), &mut scene, &integral);
        scene.headless.image()
    });
    for (a, b) in [(0, 1), (1, 3)] {
        assert!(difference(&images[a], &images[b]).0 > 8, "filters {a} and {b} look alike");
    }
    assert_eq!(images[1], images[2], "smooth occlusion changes a picture without occlusion");
}

#[test]
fn all_filters_are_exact() {
    let volume = folded_volume(UVec3::new(30, 28, 26), DVec3::new(1.0, 1.1, 0.9));
    for resolution in [OcclusionResolution::Full, OcclusionResolution::Half] {
        let mut scene = TestScene::new(volume.clone(), opaque_ramp(), few_rays(), ShadingMode::Cao);
        let entity = scene.volume;
        let mut occlusion = scene.world().get_mut::<AmbientOcclusion>(entity).expect("occlusion");
        occlusion.method.rays_mut().expect("rays").resolution = resolution;
        let carver = scene.carve(Cuboid::new(11.0, 9.0, 13.0), ClipMesh::default(), Transform::default());
        let other = scene.carve(Sphere::new(5.0), ClipMesh::default(), Transform::default());
        for (step, filter) in (0u8..).zip(Reconstruction::ALL) {
            set_shading(&mut scene, |shading| shading.reconstruction = filter);
            for k in 0..3u8 {
                let x = 2.0 + 1.3 * f32::from(k) - f32::from(step);
                scene.move_carver(
                    carver,
                    Transform::from_xyz(x, 5.0, 8.0).with_rotation(Quat::from_rotation_y(x)),
                );
                scene.move_carver(other, Transform::from_xyz(-6.0, 3.0 + x, 9.0));
                if resolution == OcclusionResolution::Full {
                    assert_exact(&mut scene, filter.name());
                } else {
                    assert_images_are_exact(&mut scene, filter.name());
                }
            }
        }
    }
}

#[test]
fn occlusion_has_no_grain() {
    // An edge half as wide as a scanner's: surfaces of trilinear intensities are bumpy.
    let normal = DVec3::new(0.29, 0.43, 0.855);
    let plane = volume_from(UVec3::splat(BALL), DVec3::ONE, |p| {
        let inside = -0.5 * f64::from(BALL) * p.dot(normal);
        1.0 / (1.0 + (-1.702 * inside / 0.45).exp())
    });
    let ramp = TransferFunction::ramp(76.0, 179.0, 1.0, [0.8; 3]).expect("a valid ramp");
    let mut scene = TestScene::new(plane, ramp, default(), ShadingMode::Cao);
    // A voxel takes three pixels.
    let camera = scene.camera();
    let place = in_world_units(Transform::from_translation(55.0 * normal.as_vec3())).with_scale(Vec3::ONE);
    scene.world().entity_mut(camera).insert(place.looking_at(Vec3::ZERO, Vec3::Y));
    let grain = Reconstruction::ALL.map(|filter| {
        set_shading(&mut scene, |shading| (shading.reconstruction, shading.jitter) = (filter, false));
        scene.settle();
        let image = scene.headless.image();
        let side = ((image.len() / 4) as f64).sqrt() as usize;
        let level = |x: usize, y: usize| f64::from(image[4 * (y * side + x) + 1]);
        let middle = side * 3 / 8..side * 5 / 8;
        // Each pixel against the mean of a square of 9 pixels around it.
        let off = middle.clone().flat_map(|y| middle.clone().map(move |x| (x, y))).map(|(x, y)| {
            let around = (0..81).map(|k| level(x + k % 9 - 4, y + k / 9 - 4)).sum::<f64>() / 81.0;
            (level(x, y) - around).powi(2)
        });
        let off: Vec<f64> = off.collect();
        (off.iter().sum::<f64>() / off.len() as f64).sqrt()
    });
    println!("grain {grain:.2?} levels");
    assert!(grain[1] < 0.75 * grain[0] && grain[2] < 0.9 * grain[1], "grain {grain:?} levels");
}

#[test]
fn a_band_between_two_samples_is_seen() {
    // Intensities from 120 to 130 alone are opaque. The edge passes through them in a fifth of a voxel.
    let points = [(0.0, 0.0), (120.0, 0.0), (122.0, 1.0), (128.0, 1.0), (130.0, 0.0)];
    let points = points.map(|(value, opacity)| ControlPoint { value, color: [1.0; 3], opacity });
    let band = TransferFunction::new(points.to_vec(), 1.0).expect("a valid band");
    let mut scene = TestScene::new(ball(), band, few_rays(), ShadingMode::Solid);
    set_shading(&mut scene, |shading| (shading.step_voxels, shading.jitter) = (0.125, false));
    scene.settle();
    let fine = scene.headless.image();
    let background = &fine[..4];
    let shown = |image: &[u8]| image.chunks(4).filter(|pixel| pixel[0] > 128).count();
    assert!(shown(&fine) > 500 && background[0] < 128, "{} pixels show the band", shown(&fine));
    set_shading(&mut scene, |shading| shading.step_voxels = 1.0);
    scene.settle();
    let coarse = shown(&scene.headless.image());
    // At points alone, half of the rays find nothing in it at the first of its two sides.
    assert!(coarse * 100 > shown(&fine) * 98, "{coarse} of {} pixels", shown(&fine));
}

#[test]
fn a_ball_is_shaded_evenly() {
    // The threshold is as steep as in the picture of a bone.
    let steep = TransferFunction::ramp(127.0, 128.0, 1.0, [0.8; 3]).expect("a valid ramp");
    let mut scene = TestScene::new(ball(), steep, default(), ShadingMode::Cao);
    scene.settle();
    let spread = |scene: &TestScene| {
        let image = scene.headless.image();
        let shown: Vec<_> = image.chunks(4).map(|pixel| f64::from(pixel[0])).collect();
        let size = (shown.len() as f64).sqrt() as usize;
        // The ball's middle, where nothing depends on its outline.
        let middle = |k: &usize| (k % size).abs_diff(size / 2).max((k / size).abs_diff(size / 2)) < size / 8;
        let shown: Vec<_> = (0..shown.len()).filter(middle).map(|k| shown[k]).collect();
        let mean = shown.iter().sum::<f64>() / shown.len() as f64;
        (shown.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / shown.len() as f64).sqrt()
    };
    let means = spread(&scene);
    let volume = scene.volume;
    scene.world().get_mut::<AmbientOcclusion>(volume).expect("occlusion").opacities =
        VoxelOpacities::OfCenters;
    scene.settle();
    let centers = spread(&scene);
    assert!(means < 1.0 && means < 0.7 * centers, "spread {means} by means, {centers} by centres");
}

#[test]
fn opacities_are_means_over_voxels() {
    let size = UVec3::new(14, 12, 10);
    let volume = folded_volume(size, DVec3::ONE);
    for function in [opaque_ramp(), translucent_ramp()] {
        let mut scene = TestScene::new(volume.clone(), function.clone(), few_rays(), ShadingMode::Cao);
        scene.settle();
        let stored = scene.opacities();
        let at = |place: IVec3| {
            let place = place.clamp(IVec3::ZERO, size.as_ivec3() - 1).as_uvec3();
            volume.value_at(place).unwrap_or_default()
        };
        for (index, stored) in (0..).zip(&stored) {
            let voxel = voxel_at(index, size).as_ivec3();
            let sides = [IVec3::X, IVec3::Y, IVec3::Z].map(|step| [at(voxel - step), at(voxel + step)]);
            let gradient = DVec3::from_array(sides.map(|[before, behind]| 0.5 * (behind - before)));
            let own = at(voxel);
            let lowest = sides.iter().flatten().copied().fold(own, f64::min);
            let highest = sides.iter().flatten().copied().fold(own, f64::max);
            let half = 0.5 * gradient.length();
            let (low, high) = ((own - half).max(lowest), (own + half).min(highest));
            let opacity = |k: u32| {
                let value = low + (high - low) * (f64::from(k) + 0.5) / 256.0;
                f64::from(function.sample(value as f32)[3])
            };
            let expected = 255.0 * (0..256).map(opacity).sum::<f64>() / 256.0;
            // Half a byte is rounding. The table's entries are a sixteenth of an intensity apart.
            assert!((expected - f64::from(*stored)).abs() <= 0.8, "{voxel}: {stored} for {expected}");
        }
    }
}
