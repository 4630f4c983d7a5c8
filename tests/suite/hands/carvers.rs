//! Carvers in hands: triggers, shapes, operations, sizes.

use bevy::prelude::*;
use bevy_contextual_ao::prelude::*;

use super::bench::{Bench, FRAME_S};

/// A carver in hand 0 by a way: a child, a thing that is held, a child of a tool that is held.
fn carver(bench: &mut Bench, way: usize, held_carver: HeldCarver) -> Entity {
    let (thing, hand) = (bench.thing, bench.hands[0]);
    let mesh = held_carver.shapes.first().cloned().unwrap_or_default();
    let world = bench.app.world_mut();
    let carver = if way == 1 { thing } else { world.spawn(ChildOf([hand, thing, thing][way])).id() };
    world.entity_mut(carver).insert((held_carver, Mesh3d(mesh)));
    if way > 0 {
        bench.app.world_mut().entity_mut(hand).insert(Holds(thing));
    }
    bench.app.update();
    carver
}

fn new_bench() -> Bench {
    Bench::new(&[], Grabbable::default())
}

#[test]
fn a_carver_carves_while_the_trigger_of_its_hand_is_pulled() {
    for way in 0..3 {
        let mut bench = new_bench();
        let carver = carver(&mut bench, way, HeldCarver::default());
        let hands = bench.hands;
        for (trigger, other, is_active) in [
            (0.0, 1.0, false),
            (0.5, 0.0, false),
            (0.7, 0.0, true),
            (0.5, 0.0, true),
            (f32::NAN, 0.0, true),
            (0.3, 0.0, false),
        ] {
            bench.edit(hands[0], |hand: &mut Hand| hand.trigger = trigger);
            bench.edit(hands[1], |hand: &mut Hand| hand.trigger = other);
            bench.app.update();
            assert_eq!(bench.get::<ClipMesh>(carver).is_active, is_active, "way {way}: {trigger}");
        }
        // Hands leave other carvers alone.
        bench.edit(carver, |carver: &mut HeldCarver| carver.carves = CarveWhile::Active);
        for is_active in [true, false] {
            bench.edit(carver, |clip_mesh: &mut ClipMesh| clip_mesh.is_active = is_active);
            bench.edit(hands[0], |hand: &mut Hand| hand.trigger = f32::from(!is_active));
            bench.app.update();
            assert_eq!(bench.get::<ClipMesh>(carver).is_active, is_active);
        }
    }
}

#[test]
fn shapes_and_operations_change_by_events_on_carver_or_hand() {
    for way in 0..3 {
        let mut bench = new_bench();
        let mut meshes = bench.app.world_mut().resource_mut::<Assets<Mesh>>();
        let shapes: Vec<_> = (1..4).map(|size| meshes.add(Sphere::new(size as f32))).collect();
        let foreign = meshes.add(Cuboid::default());
        let carver = carver(&mut bench, way, HeldCarver { shapes: shapes.clone(), ..default() });
        let [hand, other] = bench.hands;
        let change = |bench: &mut Bench, entity: Entity, steps: i32| {
            bench.app.world_mut().trigger(ChangeShape { entity, steps });
            let mesh = bench.get::<Mesh3d>(carver).0;
            shapes.iter().position(|shape| *shape == mesh)
        };
        let steps = [(1, 1), (1, 2), (1, 0), (-1, 2), (-5, 0), (0, 0), (i32::MAX, 1), (i32::MIN, 2)];
        for (entity, (steps, expected)) in [hand, carver].into_iter().cycle().zip(steps) {
            assert_eq!(change(&mut bench, entity, steps), Some(expected), "way {way}: by {steps}");
        }
        assert_eq!(change(&mut bench, other, 1), Some(2), "of another hand");
        for (steps, expected) in [(1, 0), (-1, 2)] {
            bench.edit(carver, |mesh: &mut Mesh3d| mesh.0 = foreign.clone());
            assert_eq!(change(&mut bench, carver, steps), Some(expected));
        }
        bench.edit(carver, |carver: &mut HeldCarver| carver.shapes.clear());
        assert_eq!(change(&mut bench, carver, 1), Some(2));

        let toggled = |bench: &mut Bench, entity: Entity| {
            bench.app.world_mut().trigger(ToggleOperation { entity });
            bench.get::<ClipMesh>(carver).operation
        };
        assert_eq!(toggled(&mut bench, hand), ClipOperation::Intersect);
        assert_eq!(toggled(&mut bench, other), ClipOperation::Intersect);
        assert_eq!(toggled(&mut bench, carver), ClipOperation::Subtract);
    }
}

#[test]
fn carvers_grow_at_a_rate_within_limits_and_things_in_hand_follow_meanwhile() {
    for way in 0..3 {
        let mut bench = new_bench();
        let held_carver = HeldCarver { growth_per_second: 3.0, min_scale: 0.5, max_scale: 4.0, ..default() };
        let carver = carver(&mut bench, way, held_carver);
        let hand = bench.hands[0];
        bench.edit(carver, |place: &mut Transform| place.scale = Vec3::new(1.0, -0.5, 0.7));
        bench.app.update();
        let in_hand =
            |bench: &Bench| bench.world(hand).inverse().transform_point3(bench.world(carver).translation);
        let before = in_hand(&bench);
        for (scaling, frames, expected) in [
            (5.0, 10, 3.0),
            (1.0, 20, 4.0),
            (-0.5, 10, 4.0 / 3f32.sqrt()),
            (-1.0, 40, 0.5),
            (f32::NAN, 10, 0.5),
        ] {
            bench.edit(hand, |hand: &mut Hand| hand.scaling = scaling);
            for frame in 0..frames {
                bench.place(
                    0,
                    Transform::from_xyz(0.1 * frame as f32, 0.0, 0.3)
                        .with_rotation(Quat::from_rotation_x(1.0)),
                );
                bench.app.update();
            }
            let scale = bench.get::<Transform>(carver).scale;
            let off = (scale - expected * Vec3::new(1.0, -0.5, 0.7)).abs().max_element();
            assert!(
                off < 1e-5 * expected,
                "way {way}: {scale} after {} s of {scaling}",
                frames as f32 * FRAME_S
            );
        }
        let off = in_hand(&bench).distance(before);
        assert!(off < 1e-5, "way {way}: it is left behind by {off}");
    }
}
