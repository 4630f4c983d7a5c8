//! Held carvers and held volumes in pictures: complete in the frame of the hand's move, and at no needless cost.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{
    diagnostics::{SPAN_CLIP, SPAN_CULL, SPAN_DEPTH, SPAN_DILATE},
    prelude::*,
    volume::WORLD_UNITS_PER_MM,
};
use contextual_ao_kit::mode::ShadingMode;

use crate::scene::{TestScene, count_different, few_rays, folded_volume, in_world_units, opaque_ramp};

/// A hand by its place, mm, and its turn. The app moves it in `Update`, as devices are read.
#[derive(Resource, Clone, Copy)]
struct Wanted(Transform);

fn scene(wanted: Transform) -> (TestScene, Entity) {
    let volume = folded_volume(UVec3::new(26, 24, 22), DVec3::ONE);
    let mut scene = TestScene::with(volume, opaque_ramp(), few_rays(), ShadingMode::Cao, |app| {
        app.insert_resource(Wanted(wanted)).add_systems(
            Update,
            |wanted: Res<Wanted>, mut hands: Query<&mut Transform, With<Hand>>| {
                for mut hand in &mut hands {
                    hand.set_if_neq(wanted.0);
                }
            },
        );
    });
    let hand = scene.world().spawn(Hand { reach: 1.0, ..default() }).id();
    (scene, hand)
}

fn at(x: f32, turn: f32) -> Transform {
    Transform::from_xyz(x, 2.0, 8.0).with_rotation(Quat::from_euler(EulerRot::XYZ, turn, 0.3 * turn, 0.2))
}

fn in_metres(pose: Transform) -> Transform {
    pose.with_translation(pose.translation * WORLD_UNITS_PER_MM)
}

/// A scene whose hand holds a carver in front of it.
fn carving(pose: Transform, trigger: f32) -> (TestScene, Entity) {
    let (mut scene, hand) = scene(in_metres(pose));
    let offset = Transform::from_xyz(1.0, 0.5, -4.0).with_rotation(Quat::from_rotation_x(0.4));
    let carver = scene.carve(Cuboid::new(9.0, 7.0, 8.0), ClipMesh::default(), offset);
    scene.world().entity_mut(carver).insert((HeldCarver::default(), ChildOf(hand)));
    scene.world().get_mut::<Hand>(hand).expect("a hand").trigger = trigger;
    scene.settle();
    scene.headless.frame();
    (scene, hand)
}

#[test]
fn a_held_carver_carves_in_the_frame_of_the_hands_move() {
    let (mut scene, hand) = carving(at(4.0, 0.3), 1.0);
    let mut last = scene.headless.image();
    for (x, turn) in [(1.0, 0.5), (-3.0, -0.2)] {
        scene.world().insert_resource(Wanted(in_metres(at(x, turn))));
        scene.headless.frame();
        let (image, occlusion) = (scene.headless.image(), scene.occlusion());
        assert!(image != last, "the move does not show");
        let (mut fresh, _) = carving(at(x, turn), 1.0);
        fresh.headless.frame();
        assert!(image == fresh.headless.image(), "the picture is not that of the hand's pose");
        assert_eq!(count_different(&occlusion, &fresh.occlusion()), 0);
        last = image;
    }
    // The trigger counts in its frame, too.
    scene.world().get_mut::<Hand>(hand).expect("a hand").trigger = 0.0;
    scene.headless.frame();
    let whole = scene.headless.image();
    let (fresh, _) = carving(at(-3.0, -0.2), 0.0);
    assert!(whole != last && whole == fresh.headless.image());
    scene.world().get_mut::<Hand>(hand).expect("a hand").trigger = 1.0;
    scene.headless.frame();
    assert!(scene.headless.image() == last);
}

#[test]
fn a_volume_in_the_hand_with_its_carvers_costs_what_a_camera_move_costs() {
    let path: Vec<_> = (0..=6).map(|step| at(0.5 * step as f32, 0.05 * step as f32)).collect();
    let (mut scene, hand) = scene(in_metres(path[0]));
    let (volume, carver) = (scene.volume, in_world_units(Transform::from_xyz(4.0, 3.0, 4.0)));
    let carver_entity = scene.carve(Sphere::new(6.0), ClipMesh::default(), Transform::IDENTITY);
    scene.world().entity_mut(carver_entity).insert((carver, ChildOf(volume)));
    scene.world().entity_mut(volume).insert(Grabbable::default());
    scene.settle();
    scene.headless.frame();
    let passes = |scene: &mut TestScene| {
        scene.headless.frame();
        scene.status().passes
    };
    scene.world().get_mut::<Hand>(hand).expect("a hand").grip = 1.0;
    let before = passes(&mut scene);
    let first = scene.headless.image();
    for pose in &path {
        scene.world().insert_resource(Wanted(in_metres(*pose)));
        scene.headless.frame();
        let image = scene.headless.image();
        scene.headless.frame();
        assert!(scene.headless.image() == image, "the volume comes later than the hand");
    }
    assert!(scene.headless.image() != first, "the volume does not move");
    let out = passes(&mut scene);
    for span in [SPAN_DEPTH, SPAN_DILATE, SPAN_CULL, SPAN_CLIP] {
        assert_eq!(out.jobs(span), before.jobs(span), "{span}");
    }
    // On the way back all that is seen has been cast.
    for pose in path.iter().rev() {
        scene.world().insert_resource(Wanted(in_metres(*pose)));
        let (work, clipped) = scene.headless.count_all_work(volume);
        assert_eq!((work.voxels, clipped.bricks_clipped), (0, 0));
    }
    scene.headless.frame();
    assert!(scene.headless.image() == first, "it does not come back");
}
