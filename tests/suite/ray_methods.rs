//! The variants of local ambient occlusion: half resolution, a sky, progressive rays.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{occlusion::ProgressiveRays, prelude::*};
use contextual_ao_kit::mode::ShadingMode;

use crate::headless::different_pixels;
use crate::needs;
use crate::scene::{FEW_RAYS, TestScene, few_rays, folded_volume, is_empty, opaque_ramp, translucent_ramp};

fn scene(function: TransferFunction, occlusion: AmbientOcclusion) -> (TestScene, Entity) {
    let volume = folded_volume(UVec3::new(31, 29, 26), DVec3::new(1.0, 1.1, 0.9));
    let mut scene = TestScene::new(volume, function, occlusion, ShadingMode::Cao);
    let carver = scene.carve(Sphere::new(8.0), ClipMesh::default(), Transform::from_xyz(5.0, 6.0, 7.0));
    scene.settle();
    (scene, carver)
}

fn image_as_lao(scene: &mut TestScene) -> Vec<u8> {
    scene.set_mode(ShadingMode::Lao);
    scene.headless.frame();
    let image = scene.headless.image();
    scene.set_mode(ShadingMode::Cao);
    image
}

#[test]
fn half_resolution_and_skies_are_exact_too() {
    let half = AmbientOcclusion::by(OcclusionRays { resolution: OcclusionResolution::Half, ..FEW_RAYS });
    let cloudy = AmbientOcclusion { sky: Sky::above(Vec3::Y), ..few_rays() };
    for (name, occlusion) in [("half", half), ("cloudy", cloudy)] {
        for function in [opaque_ramp(), translucent_ramp()] {
            let (mut scene, carver) = scene(function, occlusion.clone());
            // The step before the last reads factors of bricks that are transparent themselves.
            for step in 0..9 {
                let (turn, way) = ((step % 7) as f32, step as f32);
                let rotation = Quat::from_rotation_y(0.3 * turn + 0.01 * way);
                let pose =
                    Transform::from_xyz(5.0 - 1.7 * turn - 0.003 * way, 6.0, 7.0).with_rotation(rotation);
                scene.move_carver(carver, pose);
                scene.headless.frame();
                let image = scene.headless.image();
                let reference = image_as_lao(&mut scene);
                assert_eq!(different_pixels(&image, &reference), 0, "{name}, step {step}");
                // The scene returns to CAO, so that the next step changes what carving left.
                scene.headless.frame();
            }
        }
    }
}

#[test]
fn carving_at_half_resolution_casts_fewer_voxels() {
    if !needs::counters(&mut scene(opaque_ramp(), few_rays()).0) {
        return;
    }
    let work = |resolution| {
        let rays = OcclusionRays { resolution, ..FEW_RAYS };
        let (mut scene, carver) = scene(opaque_ramp(), AmbientOcclusion::by(rays));
        scene.move_carver(carver, Transform::from_xyz(4.0, 6.0, 7.0));
        scene.headless.count_work(scene.volume).voxels
    };
    let (full, half) = (work(OcclusionResolution::Full), work(OcclusionResolution::Half));
    assert!(half > 0 && 3 * half < full, "{half} of {full}");
}

fn progressive(rays_per_frame: u32, kept_on_change: f32) -> AmbientOcclusion {
    AmbientOcclusion::by(ProgressiveRays { rays: FEW_RAYS, rays_per_frame, kept_on_change })
}

/// Largest difference between two images, bytes.
fn largest_difference(a: &[u8], b: &[u8]) -> u8 {
    assert!(!is_empty(a), "nothing is shown");
    a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max().expect("two images")
}

#[test]
fn progressive_rays_lag_and_arrive() {
    let (mut scene, carver) = scene(opaque_ramp(), progressive(3, 0.0));
    // Ten rays are cast, three a frame.
    scene.headless.frames(4);
    let before = scene.status().passes.total_jobs();
    scene.headless.frames(3);
    assert_eq!(scene.status().passes.total_jobs(), before, "it rests");
    let reference = image_as_lao(&mut scene);
    scene.headless.frames(5);
    assert!(scene.headless.image() == reference, "all rays have been cast");
    scene.move_carver(carver, Transform::from_xyz(1.0, 6.0, 7.0));
    scene.headless.frame();
    let first = scene.headless.image();
    scene.headless.frames(3);
    let last = scene.headless.image();
    let reference = image_as_lao(&mut scene);
    assert!(largest_difference(&first, &reference) > 20, "three of ten rays are noisy");
    assert!(last == reference, "after four frames all have been cast");
}

#[test]
fn progressive_rays_settle_to_all_rays_whatever_they_keep() {
    // Ten rays, of which the last frame casts fewer than three. Frames of motion leave words at different rays.
    for (rays, kept) in [(1, 0.0), (1, 0.5), (3, 1.0), (1, 1.0)] {
        let (mut scene, carver) = scene(opaque_ramp(), progressive(rays, kept));
        scene.headless.frames(12);
        for step in 0..5 {
            scene.move_carver(carver, Transform::from_xyz(step as f32 - 3.0, 6.0, 7.0));
            scene.headless.frames(2);
        }
        scene.headless.frames(12);
        let image = scene.headless.image();
        assert!(image == image_as_lao(&mut scene), "{rays} rays, kept {kept}");
    }
}

#[test]
fn progressive_rays_are_cast_only_where_something_changed() {
    // Nothing is kept, so that every voxel that is cast anew is seen.
    let volume = folded_volume(UVec3::new(80, 20, 20), DVec3::ONE);
    let mut scene = TestScene::new(volume, opaque_ramp(), progressive(1, 0.0), ShadingMode::Cao);
    let carver = scene.carve(Sphere::new(2.0), ClipMesh::default(), Transform::from_xyz(36.0, 6.0, 7.0));
    scene.headless.frames(12);
    let before = scene.headless.image();
    scene.move_carver(carver, Transform::from_xyz(36.5, 6.0, 7.0));
    scene.headless.frame();
    let pixels = |image: &[u8]| image.chunks(4).map(<[u8]>::to_vec).collect::<Vec<_>>();
    let (before, now) = (pixels(&before), pixels(&scene.headless.image()));
    let shown = before.iter().filter(|pixel| **pixel != before[0]).count();
    let changed = before.iter().zip(&now).filter(|(before, now)| before != now).count();
    assert!(changed > 0 && 2 * changed < shown, "{changed} of {shown} pixels");
}

/// RMS difference of two images, of 1.
fn difference(a: &[u8], b: &[u8]) -> f64 {
    let square = |(a, b): (&u8, &u8)| ((f64::from(*a) - f64::from(*b)) / 255.0).powi(2);
    (a.iter().zip(b).map(square).sum::<f64>() / a.len() as f64).sqrt()
}

#[test]
fn a_running_mean_is_steadier_than_a_fresh_start() {
    let [fresh, kept] = [0.0, 1.0].map(|kept| {
        let (mut scene, carver) = scene(opaque_ramp(), progressive(1, kept));
        scene.headless.frames(12);
        // To and fro, a tenth of a voxel.
        for step in 0..15 {
            let x = 4.0 + 0.1 * f64::from(step % 2) as f32;
            scene.move_carver(carver, Transform::from_xyz(x, 6.0, 7.0));
            scene.headless.frame();
        }
        let image = scene.headless.image();
        difference(&image, &image_as_lao(&mut scene))
    });
    assert!(kept < 0.5 * fresh, "{kept}, {fresh}");
}

#[test]
fn settings_that_are_no_numbers_do_no_harm() {
    for (rays, kept) in [(0, f32::NAN), (u32::MAX, f32::INFINITY), (4, -1.0)] {
        let (mut scene, _) = scene(opaque_ramp(), progressive(rays, kept));
        scene.headless.frames(14);
        let image = scene.headless.image();
        let reference = image_as_lao(&mut scene);
        assert!(largest_difference(&image, &reference) <= 1, "{rays} rays, kept {kept}");
    }
    let mut dark = few_rays();
    dark.sky = Sky([f32::NAN; 8]);
    let (scene, _) = scene(opaque_ramp(), dark);
    let image = scene.headless.image();
    assert!(!is_empty(&image));
    let (same, _) = self::scene(opaque_ramp(), few_rays());
    assert_eq!(image, same.headless.image(), "no sky is an even sky");
}
