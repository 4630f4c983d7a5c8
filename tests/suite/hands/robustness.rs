//! Hands and things that go, poses that are no poses, and rest.

use bevy::{ecs::component::Mutable, prelude::*};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::random::Random;

use super::bench::{Bench, parents, pose, thing};

fn held(random: &mut Random) -> Bench {
    let mut bench = Bench::new(&parents()[2], thing(random));
    for hand in 0..2 {
        bench.place(hand, pose(random));
    }
    bench.grip([true, true]);
    bench.take_events();
    bench
}

#[test]
fn a_hand_that_goes_lets_go_and_the_other_goes_on() {
    let mut random = Random(11);
    for way in 0..2 {
        let mut bench = held(&mut random);
        let (thing, [gone, other]) = (bench.thing, bench.hands);
        let before = bench.get::<Transform>(thing);
        match way {
            0 => assert!(bench.app.world_mut().despawn(gone)),
            _ => {
                bench.app.world_mut().entity_mut(gone).remove::<Hand>();
            }
        }
        bench.app.update();
        assert_eq!(bench.take_events(), [(false, thing, gone)]);
        assert_eq!(bench.holders(), [other]);
        assert_eq!(bench.get::<Transform>(thing), before);
        let in_hand = bench.world(other).inverse() * bench.world(thing);
        bench.place(1, pose(&mut random));
        bench.app.update();
        let now = bench.world(other).inverse() * bench.world(thing);
        assert!(super::bench::difference(in_hand, now) < 1e-6);
        bench.app.world_mut().despawn(other);
        bench.app.update();
        assert!(bench.app.world().get::<HeldBy>(thing).is_none());
    }
}

#[test]
fn a_thing_that_goes_leaves_both_hands_empty() {
    let mut random = Random(12);
    for way in 0..2 {
        let mut bench = held(&mut random);
        let (thing, hands) = (bench.thing, bench.hands);
        match way {
            0 => assert!(bench.app.world_mut().despawn(thing)),
            _ => {
                bench.app.world_mut().entity_mut(thing).remove::<Grabbable>();
            }
        }
        bench.app.update();
        assert_eq!(bench.take_events(), hands.map(|hand| (false, thing, hand)));
        for hand in hands {
            assert!(bench.app.world().get::<Holds>(hand).is_none());
            bench.edit(hand, |hand: &mut Hand| hand.grip = 0.0);
        }
        bench.app.update();
        // Hands can grab another.
        let other = bench.app.world_mut().spawn(Grabbable::default()).id();
        bench.edit(hands[0], |hand: &mut Hand| hand.grip = 1.0);
        bench.app.update();
        assert_eq!(bench.app.world().get::<Holds>(hands[0]), Some(&Holds(other)));
    }
}

#[test]
fn a_clone_is_held_by_nothing_and_holds_nothing() {
    let mut random = Random(13);
    let mut bench = held(&mut random);
    let (thing, hand) = (bench.thing, bench.hands[0]);
    let world = bench.app.world_mut();
    let [thing_copy, hand_copy] = [thing, hand].map(|entity| world.entity_mut(entity).clone_and_spawn());
    let before = bench.get::<Transform>(thing_copy);
    bench.place(0, pose(&mut random));
    bench.app.update();
    assert_eq!(bench.get::<Transform>(thing_copy), before);
    assert_eq!(bench.holders(), bench.hands);
    assert!(bench.app.world().get::<Holds>(hand_copy).is_none());
}

#[test]
fn poses_that_are_none_and_hands_in_one_place_change_nothing() {
    let mut random = Random(14);
    let mut bench = held(&mut random);
    let (thing, poses) = (bench.thing, bench.hands.map(|hand| bench.get::<Transform>(hand)));
    bench.place(0, pose(&mut random));
    bench.app.update();
    let before = bench.get::<Transform>(thing);
    let [good, other] = [bench.get::<Transform>(bench.hands[0]), poses[1]];
    let nan = f32::NAN;
    let wrong = [
        Transform::from_xyz(nan, 0.0, 0.0),
        Transform::from_xyz(0.0, f32::INFINITY, 0.0),
        good.with_rotation(Quat::from_xyzw(nan, 0.0, 0.0, 1.0)),
        good.with_rotation(Quat::from_xyzw(0.0, 0.0, 0.0, 0.0)),
        good.with_scale(Vec3::new(1.0, 0.0, 1.0)),
        good.with_scale(Vec3::splat(nan)),
        good.with_translation(other.translation),
        good.with_translation(other.translation + 0.0005 * Vec3::X),
    ];
    for wrong in wrong {
        bench.place(0, wrong);
        bench.app.update();
        assert_eq!(bench.get::<Transform>(thing), before, "by {wrong:?}");
        bench.place(0, good);
        bench.app.update();
        assert_eq!(bench.get::<Transform>(thing), before, "after {wrong:?}");
    }
    // The grab waits for places that are some.
    bench.grip([false, false]);
    bench.place(0, other);
    bench.grip([true, true]);
    assert_eq!(bench.holders().len(), 2);
    bench.place(0, good);
    bench.app.update();
    assert_eq!(bench.get::<Transform>(thing), before, "it begins where hands have been apart");
    bench.place(0, poses[0]);
    bench.app.update();
    assert_ne!(bench.get::<Transform>(thing), before);
    // A thing without a place is left alone.
    bench.edit(thing, |place: &mut Transform| place.scale.x = nan);
    bench.place(0, good);
    bench.app.update();
    assert!(bench.get::<Transform>(thing).scale.x.is_nan());
}

/// Entities whose component changed in the last frame.
#[derive(Resource, Default)]
struct Writes(Vec<Entity>);

fn watch<C: Component<Mutability = Mutable>>(app: &mut App) {
    app.add_systems(Last, |changed: Query<Entity, Changed<C>>, mut writes: ResMut<Writes>| {
        writes.0.extend(&changed);
    });
}

#[test]
fn nothing_is_written_at_rest_or_when_a_rig_moves_as_a_whole() {
    let mut random = Random(15);
    let mut bench = Bench::new(&[Transform::default()], thing(&mut random));
    bench.app.init_resource::<Writes>();
    watch::<Transform>(&mut bench.app);
    watch::<ClipMesh>(&mut bench.app);
    watch::<Mesh3d>(&mut bench.app);
    watch::<Hand>(&mut bench.app);
    let take = |bench: &mut Bench| {
        bench.app.update();
        core::mem::take(&mut bench.app.world_mut().resource_mut::<Writes>().0)
    };
    let rig = bench.get::<ChildOf>(bench.thing).parent();
    let world = bench.app.world_mut();
    for hand in bench.hands {
        world.entity_mut(hand).insert(ChildOf(rig));
        world.spawn((HeldCarver::default(), Mesh3d::default(), ChildOf(hand)));
    }
    for grips in [[false; 2], [true, false], [true; 2]] {
        for hand in 0..2 {
            bench.place(hand, pose(&mut random));
        }
        bench.grip(grips);
        for hand in 0..2 {
            bench.place(hand, pose(&mut random));
        }
        take(&mut bench);
        for _ in 0..3 {
            assert!(take(&mut bench).is_empty(), "written at rest");
        }
        for _ in 0..100 {
            // So far away that rounding would show.
            let place = Transform { translation: 1e8 * random.point(), ..pose(&mut random) };
            bench.edit(rig, |rig: &mut Transform| *rig = place);
            assert_eq!(take(&mut bench), [rig], "when the rig moves");
        }
    }
}
