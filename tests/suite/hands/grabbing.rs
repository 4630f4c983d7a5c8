//! What hands grab, and when.

use bevy::{camera::primitives::Aabb, prelude::*};
use bevy_contextual_ao::prelude::*;

use super::bench::Bench;

fn bench() -> Bench {
    let mut bench = Bench::new(&[], Grabbable::default());
    for hand in bench.hands {
        bench.edit(hand, |hand: &mut Hand| hand.reach = 0.05);
        bench.app.world_mut().entity_mut(hand).remove::<ChildOf>();
    }
    bench
}

#[test]
fn grips_have_two_thresholds_and_nan_holds_on() {
    let mut bench = bench();
    let [hand, _] = bench.hands;
    let grips = [
        (0.5, false),
        (f32::NAN, false),
        (0.59, false),
        (0.6, true),
        (0.5, true),
        (f32::NAN, true),
        (0.41, true),
        (0.4, false),
        (0.5, false),
        (f32::INFINITY, true),
        (f32::NEG_INFINITY, false),
    ];
    for (grip, is_held) in grips {
        bench.edit(hand, |hand: &mut Hand| hand.grip = grip);
        bench.app.update();
        assert_eq!(!bench.holders().is_empty(), is_held, "at {grip}");
    }
    let thing = bench.thing;
    let event = |is_grab| (is_grab, thing, hand);
    assert_eq!(bench.take_events(), [true, false, true, false].map(event));
}

#[test]
fn only_a_hand_that_closes_within_reach_grabs() {
    let mut bench = bench();
    // The box ends at 0.1.
    for (x, is_held) in
        [(0.16, false), (0.14, true), (0.0, true), (-0.14, true), (-0.16, false), (f32::NAN, false)]
    {
        bench.place(0, Transform::from_xyz(x, 0.0, 0.0));
        bench.grip([true, false]);
        assert_eq!(!bench.holders().is_empty(), is_held, "at {x}");
        bench.grip([false, false]);
        bench.edit(bench.thing, |place: &mut Transform| *place = Transform::IDENTITY);
    }
    // A fist that comes by grabs nothing.
    bench.place(0, Transform::from_xyz(1.0, 0.0, 0.0));
    bench.grip([true, false]);
    bench.place(0, Transform::IDENTITY);
    bench.grip([true, false]);
    assert!(bench.holders().is_empty());
    for reach in [f32::NAN, -1.0] {
        bench.edit(bench.hands[1], |hand: &mut Hand| hand.reach = reach);
        bench.place(1, Transform::from_xyz(0.11, 0.0, 0.0));
        bench.grip([true, true]);
        assert!(bench.holders().is_empty(), "at a reach of {reach}");
        bench.place(1, Transform::from_xyz(0.09, 0.0, 0.0));
        bench.grip([true, false]);
        bench.grip([true, true]);
        assert_eq!(bench.holders().len(), 1, "at a reach of {reach}");
        bench.grip([true, false]);
    }
}

#[test]
fn the_nearest_thing_is_grabbed_and_of_several_around_a_hand_the_smallest() {
    let mut bench = bench();
    let cube = |half: f32| Aabb::from_min_max(Vec3::splat(-half), Vec3::splat(half));
    let world = bench.app.world_mut();
    let small = world.spawn((Grabbable::default(), cube(0.02), Transform::from_xyz(0.05, 0.0, 0.0))).id();
    let beside = world.spawn((Grabbable::default(), cube(0.01), Transform::from_xyz(0.13, 0.0, 0.0))).id();
    // A part without a box of its own is held by its origin.
    let bare = world.spawn((Grabbable::default(), Transform::from_xyz(0.0, 0.5, 0.0))).id();
    // Parts of a thing are the thing; carvers are not.
    let handle = (cube(0.05), Transform::from_xyz(0.0, -0.4, 0.0), ChildOf(bench.thing));
    world.spawn(handle);
    world.spawn((ClipMesh::default(), cube(0.05), Transform::from_xyz(-0.5, 0.0, 0.0), ChildOf(bench.thing)));
    let places = [
        (Vec3::new(0.0, 0.0, 0.0), Some(bench.thing)),
        (Vec3::new(0.05, 0.01, 0.0), Some(small)),
        (Vec3::new(0.119, 0.0, 0.0), Some(beside)),
        (Vec3::new(0.105, 0.0, 0.0), Some(bench.thing)),
        (Vec3::new(0.0, 0.47, 0.0), Some(bare)),
        (Vec3::new(0.0, -0.4, 0.0), Some(bench.thing)),
        (Vec3::new(-0.5, 0.0, 0.0), None),
    ];
    for (place, expected) in places {
        bench.place(0, Transform::from_translation(place));
        bench.grip([true, false]);
        let held = bench.app.world().get::<Holds>(bench.hands[0]).map(|holds| holds.0);
        assert_eq!(held, expected, "at {place}");
        bench.grip([false, false]);
    }
}

#[test]
fn a_third_hand_and_hands_of_the_thing_itself_do_not_grab() {
    let mut bench = bench();
    let closed = Hand { grip: 1.0, ..default() };
    let own = bench.app.world_mut().spawn((closed, ChildOf(bench.thing))).id();
    bench.app.update();
    assert!(bench.holders().is_empty(), "a thing is in its own hand");
    bench.grip([true, true]);
    let third = bench.app.world_mut().spawn(closed).id();
    bench.app.update();
    assert_eq!(bench.holders(), bench.hands);
    assert!(![own, third].iter().any(|hand| bench.app.world().get::<Holds>(*hand).is_some()));
    // A carver that hangs from a hand is not for that hand.
    let tool = (Grabbable::default(), ClipMesh::default(), ChildOf(third));
    bench.app.world_mut().spawn(tool);
    bench.edit(third, |hand: &mut Hand| hand.grip = 0.0);
    bench.app.update();
    bench.edit(third, |hand: &mut Hand| hand.grip = 1.0);
    bench.app.update();
    assert!(bench.app.world().get::<Holds>(third).is_none());
}

#[test]
fn an_app_can_put_things_into_hands_and_take_them() {
    let mut bench = bench();
    let (hand, thing) = (bench.hands[0], bench.thing);
    // It is out of reach, and the hand is open.
    bench.place(0, Transform::from_xyz(2.0, 0.0, 0.0));
    bench.app.world_mut().entity_mut(hand).insert(Holds(thing));
    bench.app.update();
    bench.place(0, Transform::from_xyz(2.0, 1.0, 0.0));
    bench.app.update();
    assert_eq!(bench.get::<Transform>(thing), Transform::from_xyz(0.0, 1.0, 0.0));
    // It stays where the app puts it, and goes on from there.
    bench.edit(thing, |place: &mut Transform| place.translation.z = 3.0);
    bench.app.update();
    bench.place(0, Transform::from_xyz(2.0, 2.0, 0.0));
    bench.app.update();
    assert_eq!(bench.get::<Transform>(thing), Transform::from_xyz(0.0, 2.0, 3.0));
    // Also where both move it in the same frame.
    bench.place(0, Transform::from_xyz(2.0, 3.0, 0.0));
    bench.edit(thing, |place: &mut Transform| place.translation.z = 4.0);
    bench.app.update();
    assert_eq!(bench.get::<Transform>(thing), Transform::from_xyz(0.0, 3.0, 4.0));
    // A new parent is no motion.
    let parent = bench.app.world_mut().spawn(Transform::from_xyz(0.0, 0.0, 5.0)).id();
    bench.app.world_mut().entity_mut(thing).insert(ChildOf(parent));
    bench.app.update();
    assert_eq!(bench.get::<Transform>(thing), Transform::from_xyz(0.0, 3.0, 4.0));
    bench.app.world_mut().entity_mut(hand).remove::<Holds>();
    bench.place(0, Transform::IDENTITY);
    bench.app.update();
    assert_eq!(bench.get::<Transform>(thing), Transform::from_xyz(0.0, 3.0, 4.0));
    assert_eq!(bench.take_events(), [(true, thing, hand), (false, thing, hand)]);
}
