//! The work lists: clipping visits what is around a change, and leaves the data of bricks as a fresh start does.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{diagnostics::ClipWork, prelude::*};
use contextual_ao_kit::mode::ShadingMode;

use crate::needs;
use crate::scene::{TestScene, few_rays, folded_volume, opaque_ramp, solid_volume};

/// Superbricks at the far edges are incomplete.
const SIZE: UVec3 = UVec3::new(70, 62, 41);

fn at(x: f32, y: f32, z: f32) -> Transform {
    Transform::from_xyz(x, y, z).with_rotation(Quat::from_rotation_x(0.1 * x))
}

/// A scene with two carvers.
fn scene() -> (TestScene, [Entity; 2]) {
    let volume = folded_volume(SIZE, DVec3::new(1.0, 1.1, 1.3));
    let mut scene = TestScene::new(volume, opaque_ramp(), few_rays(), ShadingMode::Cao);
    let ball = scene.carve(Sphere::new(13.0), ClipMesh::default(), at(20.0, 3.0, 4.0));
    let block = scene.carve(Cuboid::new(9.0, 30.0, 12.0), ClipMesh::default(), at(-15.0, 0.0, 9.0));
    scene.settle();
    (scene, [ball, block])
}

/// Carvers at their last places, from the beginning.
fn words_of_fresh_start(places: [Transform; 2], ball_is_active: bool) -> Vec<u32> {
    let (mut scene, [ball, block]) = scene();
    let [at_ball, at_block] = places;
    scene.move_carver(ball, at_ball);
    scene.move_carver(block, at_block);
    scene.world().get_mut::<ClipMesh>(ball).expect("a carver").is_active = ball_is_active;
    // Another rule makes everything stale, and so does the same rule again.
    for rule in [CoverageRule::Center, CoverageRule::default()] {
        scene.set_clip(|settings| settings.coverage = rule);
        scene.headless.frame();
    }
    scene.headless.brick_words(scene.volume)
}

#[test]
fn the_data_of_bricks_is_that_of_a_fresh_start() {
    let (mut scene, [ball, block]) = scene();
    let steps = [
        (at(19.0, 3.0, 4.0), at(-15.0, 0.0, 9.0), true),
        // Across superbricks, both at once.
        (at(2.0, -6.0, -11.0), at(-4.0, 7.0, 2.0), true),
        // Out of the volume, and back on another side.
        (at(300.0, 0.0, 0.0), at(-4.0, 7.0, 2.0), true),
        (at(-20.0, -18.0, 0.0), at(-4.0, 7.5, 2.0), true),
        // The other carver gets another number.
        (at(-20.0, -18.0, 0.0), at(-3.0, 7.5, 2.0), false),
        (at(-20.0, -18.0, 0.0), at(10.0, 7.5, 2.0), true),
    ];
    for (step, (at_ball, at_block, is_active)) in steps.into_iter().enumerate() {
        scene.move_carver(ball, at_ball);
        scene.move_carver(block, at_block);
        scene.world().get_mut::<ClipMesh>(ball).expect("a carver").is_active = is_active;
        scene.headless.frame();
        let words = scene.headless.brick_words(scene.volume);
        let expected = words_of_fresh_start([at_ball, at_block], is_active);
        assert!(words.iter().any(|word| word >> 28 > 0), "rays may leap nowhere");
        let pairs = words.iter().zip(&expected).enumerate();
        let different: Vec<_> = pairs.filter(|(_, (word, expected))| word != expected).collect();
        assert_eq!(words.len(), expected.len());
        assert!(different.is_empty(), "step {step}: (brick, (word, expected word)) {different:?}");
    }
}

/// Work of a carver's motion by a voxel, and of its last place, in a solid cube. The carver is a ball near a corner.
fn work_of_motion(side: u32, radius_mm: f32) -> Option<ClipWork> {
    let volume = solid_volume(UVec3::splat(side));
    let mut scene = TestScene::new(volume, opaque_ramp(), few_rays(), ShadingMode::Cao);
    if !needs::counters(&mut scene) {
        return None;
    }
    let corner = Vec3::splat(0.5 * side as f32 - radius_mm);
    let place = |x: f32| Transform::from_translation(corner + x * Vec3::X);
    let carver = scene.carve(Sphere::new(radius_mm), ClipMesh::default(), place(0.0));
    scene.settle();
    scene.move_carver(carver, place(-1.0));
    Some(scene.headless.count_all_work(scene.volume).1)
}

#[test]
fn clipping_touches_what_is_around_the_change() {
    let [Some(small), Some(large)] = [64, 128].map(|side| work_of_motion(side, 12.0)) else {
        return;
    };
    assert!(small.bricks_clipped > 50, "{small:?}");
    // The grid's end cuts off as much of the carver's surroundings in both.
    let growth = |work: fn(&ClipWork) -> u64| work(&large) as f64 / work(&small) as f64;
    let (bricks, bytes) = (growth(ClipWork::bricks), growth(|work| work.bytes(1)));
    assert!(bricks < 1.1 && bytes < 1.1, "{bricks} {bytes}: {small:?} {large:?}");
    // A frame that visited everything would visit all of these.
    assert!(large.superbricks_visited < 8 * 8 * 8 / 4, "{large:?}");
}
