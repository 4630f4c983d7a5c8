//! Rays that are cast a slice at a time, or over several frames, leave the same occlusion.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::prelude::*;
use bevy_contextual_ao::volume::OcclusionReady;
use contextual_ao_kit::{headless::different_pixels, mode::ShadingMode};

use crate::scene::{TestScene, count_different, few_rays, folded_volume, opaque_ramp, translucent_ramp};

fn scene(function: TransferFunction) -> (TestScene, Entity) {
    let volume = folded_volume(UVec3::new(38, 33, 29), DVec3::ONE);
    let mut scene = TestScene::new(volume, function, few_rays(), ShadingMode::Cao);
    let carver = scene.carve(Sphere::new(9.0), ClipMesh::default(), at(0));
    scene.settle();
    (scene, carver)
}

fn at(step: u32) -> Transform {
    Transform::from_xyz(9.0 - 1.5 * step as f32, 3.0, 5.0)
}

/// Moves the carver and the camera.
fn step(scene: &mut TestScene, carver: Entity, step: u32) {
    scene.move_carver(carver, at(step));
    let camera = scene.camera();
    let place = Vec3::new(0.05 + 0.004 * step as f32, 0.04, 0.07);
    let view = Transform::from_translation(place).looking_at(Vec3::ZERO, Vec3::Y);
    scene.world().entity_mut(camera).insert(view);
}

fn is_ready(scene: &TestScene) -> bool {
    scene.headless.app.world().get::<OcclusionReady>(scene.volume).is_some_and(|ready| ready.0)
}

#[test]
fn slices_change_nothing() {
    for function in [opaque_ramp(), translucent_ramp()] {
        let (mut whole, carver) = scene(function.clone());
        let (mut sliced, other_carver) = scene(function);
        sliced.world().insert_resource(CastBudget { words_per_dispatch: 7, ..default() });
        // Everything is cast anew, each slice by itself; then what a carve and a turn of the camera ask for.
        for scene in [&mut whole, &mut sliced] {
            let volume = scene.volume;
            scene.world().get_mut::<AmbientOcclusion>(volume).expect("a volume").sky = Sky::octant(3);
        }
        for k in 0..3 {
            step(&mut whole, carver, k);
            step(&mut sliced, other_carver, k);
            whole.headless.frame();
            sliced.headless.frame();
            assert_eq!(different_pixels(&whole.headless.image(), &sliced.headless.image()), 0, "step {k}");
        }
        assert_eq!(count_different(&whole.occlusion(), &sliced.occlusion()), 0);
    }
}

#[test]
fn a_budget_is_kept_and_nothing_stays_stale() {
    let (mut whole, carver) = scene(translucent_ramp());
    let (mut bounded, other_carver) = scene(translucent_ramp());
    bounded.world().insert_resource(CastBudget { words_per_frame: Some(40), ..default() });
    let mut most_different = 0;
    for k in 0..12 {
        // Faster than the budget, then more slowly.
        let k = k.min(5) + k / 6;
        step(&mut whole, carver, k);
        step(&mut bounded, other_carver, k);
        whole.headless.frame();
        bounded.headless.frame();
        let different = different_pixels(&whole.headless.image(), &bounded.headless.image());
        most_different = most_different.max(different);
    }
    assert!(most_different > 0, "the budget bounds nothing");
    assert!(!is_ready(&bounded), "words wait");
    let mut frames = 0;
    while !is_ready(&bounded) {
        bounded.headless.frame();
        frames += 1;
        assert!(frames < 200, "the words that wait do not end");
    }
    assert!(frames > 2, "words waited for {frames} frames");
    assert_eq!(different_pixels(&whole.headless.image(), &bounded.headless.image()), 0);
    assert_eq!(count_different(&whole.occlusion(), &bounded.occlusion()), 0);
    // At rest nothing is cast any more.
    let before = bounded.status().passes.total_jobs();
    bounded.headless.frames(3);
    assert_eq!(bounded.status().passes.total_jobs(), before);
}

#[test]
fn without_the_budget_all_that_waits_is_cast_at_once() {
    let (mut whole, carver) = scene(translucent_ramp());
    let (mut bounded, other_carver) = scene(translucent_ramp());
    bounded.world().insert_resource(CastBudget { words_per_frame: Some(3), ..default() });
    step(&mut whole, carver, 4);
    step(&mut bounded, other_carver, 4);
    whole.headless.frame();
    bounded.headless.frame();
    assert!(different_pixels(&whole.headless.image(), &bounded.headless.image()) > 0);
    bounded.world().insert_resource(CastBudget::default());
    bounded.headless.frame();
    assert_eq!(different_pixels(&whole.headless.image(), &bounded.headless.image()), 0);
}

#[test]
fn words_that_wait_are_forgotten_where_everything_changes_unlit() {
    let (mut whole, carver) = scene(translucent_ramp());
    let (mut bounded, other_carver) = scene(translucent_ramp());
    bounded.world().insert_resource(CastBudget { words_per_frame: Some(3), ..default() });
    for (scene, carver) in [(&mut whole, carver), (&mut bounded, other_carver)] {
        step(scene, carver, 4);
        scene.headless.frame();
        // Nothing is cast in the frame in which all occlusion becomes stale.
        scene.set_mode(ShadingMode::Solid);
        let volume = scene.volume;
        scene.world().get_mut::<AmbientOcclusion>(volume).expect("a volume").sky = Sky::octant(3);
        scene.headless.frame();
        scene.world().insert_resource(CastBudget::default());
        scene.set_mode(ShadingMode::Cao);
        scene.headless.frame();
    }
    assert_eq!(different_pixels(&whole.headless.image(), &bounded.headless.image()), 0);
    assert_eq!(count_different(&whole.occlusion(), &bounded.occlusion()), 0);
}
