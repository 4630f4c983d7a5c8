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
    let carver = scene.carve(Sphere::new(9.0), ClipMesh::default(), at(0));
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

/// Number of frames until nothing waits.
fn frames_until_ready(scene: &mut TestScene) -> u32 {
    let mut frames = 0;
    while !is_ready(scene) {
        scene.headless.frame();
        frames += 1;
        assert!(frames < 500, "the words that wait do not end");
    }
    frames
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
    // From the first frame on it is as with a budget of as many words.
    let mut images = [jump(&mut paced, paced_carver, 3), jump(&mut bounded, bounded_carver, 3)];
    assert!(different_pixels(&images[0], &exact) > 0, "nothing is bounded");
    let mut frames = 0;
    while images[0] != exact {
        assert_eq!(different_pixels(&images[0], &images[1]), 0, "frame {frames}");
        images = [frame_image(&mut paced), frame_image(&mut bounded)];
        frames += 1;
        assert!(frames < 500, "the words that wait do not end");
    }
    assert!(frames > 2, "words waited for {frames} frames");
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

/// Mean of the brightness of some pixels, as shares of those of another image.
fn brightness(image: &[u8], of: &[u8], counts: impl Fn(usize) -> bool) -> f64 {
    let sum = |image: &[u8]| -> f64 {
        let pixels = image.chunks(4).enumerate().filter(|(pixel, _)| counts(*pixel));
        pixels.flat_map(|(_, pixel)| &pixel[..3]).map(|byte| f64::from(*byte)).sum()
    };
    sum(image) / sum(of)
}

/// Brightness of a cut that has just opened, as shares of its brightness without occlusion: while almost all its rays
/// wait, and with all of them. `change` is made before the cut, with time to settle.
fn brightness_of_new_cut(change: impl Fn(&mut TestScene)) -> [f64; 2] {
    let (mut waiting, waiting_carver) = scene(FAST_MS, None);
    let (mut exact, carver) = scene(FAST_MS, None);
    waiting.world().insert_resource(budget(100_000));
    for scene in [&mut waiting, &mut exact] {
        change(scene);
        scene.headless.frames(2);
        frames_until_ready(scene);
        scene.headless.frames(2);
    }
    waiting.world().insert_resource(budget(1));
    exact.set_mode(ShadingMode::Solid);
    let before = frame_image(&mut exact);
    let open = jump(&mut exact, carver, 3);
    exact.set_mode(ShadingMode::Cao);
    let images = [jump(&mut waiting, waiting_carver, 3), frame_image(&mut exact)];
    // The cut: what looks different without occlusion.
    let is_new = |pixel: usize| before[4 * pixel..][..4] != open[4 * pixel..][..4];
    assert!((0..open.len() / 4).filter(|pixel| is_new(*pixel)).count() > 300);
    images.map(|image| brightness(&image, &open, is_new))
}

#[test]
fn a_new_cut_is_drawn_as_if_unoccluded_while_its_rays_wait() {
    let [waiting, exact] = brightness_of_new_cut(|_| {});
    println!("{waiting} while rays wait, {exact} with all of them");
    // Around the cut some voxels were seen before, and keep their factors.
    assert!((0.93..=1.0).contains(&waiting), "{waiting}");
    assert!(exact < 0.9, "there is no occlusion to wait for: {exact}");
}

#[test]
fn a_new_cut_is_drawn_by_the_present_sky() {
    let [waiting, exact] = brightness_of_new_cut(|scene| {
        let volume = scene.volume;
        scene.world().get_mut::<AmbientOcclusion>(volume).expect("a volume").sky = Sky::above(Vec3::X);
    });
    println!("{waiting} while rays wait, {exact} with all of them");
    assert!((0.9..=1.0).contains(&waiting), "{waiting}");
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
        assert!(shown > 1500 && 20 * different < shown, "{different} of {shown} pixels ({resolution:?})");
    }
}
