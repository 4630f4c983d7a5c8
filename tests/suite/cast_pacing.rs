//! The frame time bounds the rays of a frame, and what waits for its rays is drawn as if unoccluded.

use bevy::{math::DVec3, prelude::*, time::TimeUpdateStrategy};
use bevy_contextual_ao::diagnostics::RenderStatus;
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::{
    headless::{Headless, different_pixels},
    mode::ShadingMode,
};
use std::time::Duration;

use crate::scene::{FEW_RAYS, TestScene, count_different, few_rays, folded_volume, opaque_ramp};

/// Frames after which a slow one has had its effect.
const LONG: u32 = 12;
const PACING: CastPacing = CastPacing { target_frame_ms: 10.0, least_words_per_frame: 20 };
const FAST_MS: u64 = 1;
const SLOW_MS: u64 = 1000;

/// A carved volume whose frames take so long by the clock, with all its occlusion.
fn scene(frame_ms: u64, pacing: Option<CastPacing>) -> (TestScene, Entity) {
    let (mut scene, carver) = unsettled(few_rays(), |app| {
        if let Some(pacing) = pacing {
            app.insert_resource(pacing);
        }
    });
    set_frame_ms(&mut scene, frame_ms);
    scene.settle();
    scene.headless.frames(LONG);
    (scene, carver)
}

fn unsettled(occlusion: AmbientOcclusion, setup: impl FnOnce(&mut App)) -> (TestScene, Entity) {
    let volume = folded_volume(UVec3::new(38, 33, 29), DVec3::ONE);
    let mut scene = TestScene::with(volume, opaque_ramp(), occlusion, ShadingMode::Cao, setup);
    let entity = scene.volume;
    let mut shading = scene.world().get_mut::<VolumeShading>(entity).expect("a volume");
    // What is as bright as a flat surface looks unoccluded.
    shading.ambient_scale = AmbientScale::FlatSurface;
    let carver = scene.carve(Sphere::new(11.0), ClipMesh::default(), at(0));
    (scene, carver)
}

fn set_frame_ms(scene: &mut TestScene, ms: u64) {
    let frame = TimeUpdateStrategy::ManualDuration(Duration::from_millis(ms));
    scene.headless.app.insert_resource(frame);
}

fn at(step: u32) -> Transform {
    Transform::from_xyz(9.0 - 3.0 * step as f32, 3.0, 8.0)
}

/// Moves the carver and runs a frame. Returns its image.
fn jump(scene: &mut TestScene, carver: Entity, step: u32) -> Vec<u8> {
    scene.move_carver(carver, at(step));
    frame_image(scene)
}

fn frame_image(scene: &mut TestScene) -> Vec<u8> {
    scene.headless.frame();
    scene.headless.image()
}

fn is_ready(scene: &TestScene) -> bool {
    scene.headless.app.world().get::<OcclusionReady>(scene.volume).is_some_and(|ready| ready.0)
}

/// Number of frames until nothing waits. The report of a frame arrives in the next one.
fn frames_until_ready(scene: &mut TestScene) -> u32 {
    for frames in 1..500 {
        scene.headless.frame();
        if is_ready(scene) {
            return frames;
        }
    }
    panic!("the words that wait do not end");
}

fn budget(words: u32) -> CastBudget {
    CastBudget { words_per_frame: Some(words), ..default() }
}

#[test]
fn slow_frames_come_down_to_the_floor_and_no_lower() {
    let (mut whole, carver) = scene(SLOW_MS, None);
    let (mut paced, paced_carver) = scene(SLOW_MS, Some(PACING));
    let (mut bounded, bounded_carver) = scene(SLOW_MS, None);
    bounded.world().insert_resource(budget(PACING.least_words_per_frame));
    bounded.headless.frames(2);
    let exact = jump(&mut whole, carver, 3);
    assert!(different_pixels(&jump(&mut paced, paced_carver, 3), &exact) > 0, "nothing is bounded");
    jump(&mut bounded, bounded_carver, 3);
    // It takes as long as with a budget of as many words.
    let frames = [&mut paced, &mut bounded].map(frames_until_ready);
    assert!(frames[1] > 5 && frames[0].abs_diff(frames[1]) <= 1, "{frames:?} frames");
    assert_eq!(different_pixels(&paced.headless.image(), &exact), 0);
    // The user's own setting stays.
    assert_eq!(*paced.world().resource::<CastBudget>(), CastBudget::default());
}

#[test]
fn fast_frames_cast_more_until_the_exact_picture_is_there_and_rests() {
    let (mut whole, carver) = scene(SLOW_MS, None);
    let low = CastPacing { least_words_per_frame: 2, ..PACING };
    let (mut fast, fast_carver) = scene(SLOW_MS, Some(low));
    let (mut slow, slow_carver) = scene(SLOW_MS, Some(low));
    set_frame_ms(&mut fast, FAST_MS);
    let exact = jump(&mut whole, carver, 3);
    assert!(different_pixels(&jump(&mut fast, fast_carver, 3), &exact) > 0, "nothing is bounded");
    jump(&mut slow, slow_carver, 3);
    let frames = [&mut fast, &mut slow].map(frames_until_ready);
    assert!(2 * frames[0] < frames[1], "{frames:?} frames");
    for paced in [&mut fast, &mut slow] {
        assert_eq!(different_pixels(&paced.headless.image(), &exact), 0);
        assert_eq!(count_different(&whole.occlusion(), &paced.occlusion()), 0);
        paced.headless.frames(2);
        let before = paced.status().passes.total_jobs();
        paced.headless.frames(3);
        assert_eq!(paced.status().passes.total_jobs(), before, "at rest");
    }
}

#[test]
fn slow_drawing_alone_bounds_nothing() {
    let (mut whole, carver) = scene(FAST_MS, None);
    let (mut paced, paced_carver) = scene(FAST_MS, Some(PACING));
    set_frame_ms(&mut paced, SLOW_MS);
    for frame in 0..2 * LONG {
        let volume = paced.volume;
        let mut shading = paced.world().get_mut::<VolumeShading>(volume).expect("a volume");
        shading.exposure = if frame % 2 == 0 { 1.5 } else { 1.0 };
        paced.headless.frame();
    }
    assert_eq!(different_pixels(&jump(&mut whole, carver, 3), &jump(&mut paced, paced_carver, 3)), 0);
}

#[test]
fn times_that_are_none_bound_nothing() {
    let (mut whole, carver) = scene(0, None);
    for (frame_ms, target_frame_ms) in [(0, 10.0), (SLOW_MS, f32::NAN), (SLOW_MS, f32::INFINITY)] {
        let (mut paced, paced_carver) = scene(frame_ms, Some(CastPacing { target_frame_ms, ..PACING }));
        jump(&mut whole, carver, 0);
        jump(&mut paced, paced_carver, 0);
        let images = [jump(&mut whole, carver, 3), jump(&mut paced, paced_carver, 3)];
        assert_eq!(different_pixels(&images[0], &images[1]), 0, "{frame_ms} ms for {target_frame_ms}");
    }
}

#[test]
fn without_pacing_all_that_waits_is_cast_at_once() {
    let (mut whole, carver) = scene(SLOW_MS, None);
    let (mut paced, paced_carver) = scene(SLOW_MS, Some(PACING));
    let exact = jump(&mut whole, carver, 3);
    assert!(different_pixels(&jump(&mut paced, paced_carver, 3), &exact) > 0);
    paced.world().remove_resource::<CastPacing>();
    assert_eq!(different_pixels(&frame_image(&mut paced), &exact), 0);
}

/// Brightness of an image of the volume, as a share of that of another image.
fn brightness(image: &[u8], of: &[u8]) -> f64 {
    let sum = |image: &[u8]| -> f64 {
        let shown = image.chunks(4).zip(of.chunks(4)).filter(|(_, of)| **of != of_background(image));
        shown.flat_map(|(pixel, _)| &pixel[..3]).map(|byte| f64::from(*byte)).sum()
    };
    sum(image) / sum(of)
}

fn of_background(image: &[u8]) -> [u8; 4] {
    [image[0], image[1], image[2], image[3]]
}

/// Brightness of a side that comes into view, as shares of its brightness without occlusion: while almost all its rays
/// wait, and with all of them. `change` is made before, with time to settle.
fn brightness_of_new_side(change: impl Fn(&mut TestScene)) -> [f64; 2] {
    let [mut waiting, mut exact] = [(); 2].map(|()| scene(FAST_MS, None).0);
    waiting.world().insert_resource(budget(100_000));
    waiting.headless.frames(2);
    for scene in [&mut waiting, &mut exact] {
        change(scene);
        scene.headless.frames(2);
        frames_until_ready(scene);
        scene.headless.frames(2);
    }
    waiting.world().insert_resource(budget(1));
    exact.set_mode(ShadingMode::Solid);
    let open = other_side(&mut exact);
    exact.set_mode(ShadingMode::Cao);
    [other_side(&mut waiting), frame_image(&mut exact)].map(|image| brightness(&image, &open))
}

/// Image of the volume from behind.
fn other_side(scene: &mut TestScene) -> Vec<u8> {
    let camera = scene.camera();
    let mut view = scene.world().get_mut::<Transform>(camera).expect("a camera");
    *view = Transform::from_translation(-view.translation).looking_at(Vec3::ZERO, Vec3::Y);
    frame_image(scene)
}

#[test]
fn what_comes_into_view_is_drawn_as_if_unoccluded_while_its_rays_wait() {
    let [waiting, exact] = brightness_of_new_side(|_| {});
    println!("{waiting} while rays wait, {exact} with all of them");
    // Some voxels were seen before, through hollows, and keep their factors.
    assert!((0.97..=1.001).contains(&waiting), "{waiting}");
    assert!(exact < 0.99, "there is no occlusion to wait for: {exact}");
}

#[test]
fn what_comes_into_view_is_drawn_by_the_present_sky() {
    let [waiting, exact] = brightness_of_new_side(|scene| {
        let volume = scene.volume;
        scene.world().get_mut::<AmbientOcclusion>(volume).expect("a volume").sky = Sky::above(Vec3::X);
    });
    println!("{waiting} while rays wait, {exact} with all of them");
    assert!((0.97..=1.001).contains(&waiting), "{waiting}");
}

#[test]
fn a_first_image_is_not_black_while_its_rays_wait() {
    for resolution in [OcclusionResolution::Full, OcclusionResolution::Half] {
        let occlusion = AmbientOcclusion::by(OcclusionRays { resolution, ..FEW_RAYS });
        let mut images = [ShadingMode::Solid, ShadingMode::Cao].map(|mode| {
            let (mut scene, _) = unsettled(occlusion.clone(), |app| _ = app.insert_resource(budget(1)));
            scene.set_mode(mode);
            if mode == ShadingMode::Solid {
                scene.settle();
            } else {
                let casts = |headless: &Headless| {
                    let status = headless.app.world().resource::<RenderStatus>();
                    status.passes.jobs(OcclusionRays::SPAN_CAST) > 0
                };
                assert!(scene.headless.frames_until(casts));
                scene.headless.frames(4);
            }
            scene.headless.image()
        });
        let [open, waiting] = &mut images;
        // A factor is a byte, and is divided by about 0.4; a few words have been cast.
        let darker = |k: usize| open[k].abs_diff(waiting[k]) > 4;
        let different = (0..open.len() / 4).filter(|pixel| (0..3).any(|k| darker(4 * pixel + k))).count();
        let shown = open.chunks(4).filter(|pixel| **pixel != open[..4]).count();
        println!("{different} of {shown} pixels differ ({resolution:?})");
        assert!(shown > 1000 && 20 * different < shown, "{different} of {shown} pixels ({resolution:?})");
    }
}
