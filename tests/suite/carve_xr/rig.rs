//! Jumps and turns.

use super::*;

/// A bench whose rig is turned, with eyes away from its middle. Returns the rig.
fn with_eyes(bench: &mut Bench) -> Entity {
    let rig = bench.single::<With<Rig>>();
    bench.edit(rig, |transform: &mut Transform| transform.rotation = Quat::from_rotation_y(0.7));
    for side in [-0.032, 0.032] {
        bench.app.world_mut().spawn((Eye, Transform::from_xyz(0.3 + side, 1.6, -0.4), ChildOf(rig)));
    }
    rig
}

fn head(bench: &Bench, rig: Entity) -> Vec3 {
    bench.get::<Transform>(rig).transform_point(Vec3::new(0.3, 1.6, -0.4))
}

#[test]
fn a_jump_puts_the_head_on_the_place() {
    let mut bench = Bench::new();
    let rig = with_eyes(&mut bench);
    let hand = Transform::from_xyz(0.2, 1.2, 0.3).looking_to(Vec3::new(0.3, -0.2, -1.0), Vec3::Y);
    bench.edit(bench.hands[1], |transform: &mut Transform| *transform = hand);
    let start = bench.get::<Transform>(rig);
    for _ in 0..3 {
        bench.right(|controls| controls.stick_pressed = true);
        assert_eq!(bench.get::<Transform>(rig), start, "nothing moves before the stick is let go");
    }
    let in_world = start * hand;
    let place = landing(&arc(Isometry3d::new(in_world.translation, in_world.rotation))).expect("it lands");
    bench.right(|controls| controls.stick_pressed = false);
    let head = head(&bench, rig);
    assert!(head.xz().distance(place.xz()) < 1e-4, "{head} over {place}");
    let jumped = bench.get::<Transform>(rig);
    assert_eq!((jumped.translation.y, jumped.rotation), (0.0, start.rotation));
    bench.app.update();
    assert_eq!(bench.get::<Transform>(rig), jumped, "it jumps once");
}

#[test]
fn arcs_land_on_the_floor_of_the_room() {
    let aim = |from: Vec3, towards: Vec3| {
        let hand = Transform::from_translation(from).looking_to(towards, Vec3::Y);
        landing(&arc(Isometry3d::new(hand.translation, hand.rotation)))
    };
    let from = Vec3::new(0.0, 1.2, 0.0);
    // A stone that is thrown level from a height of 1.2 m falls for 0.495 s.
    let place = aim(from, Vec3::NEG_Z).expect("it lands");
    assert!(place.distance(Vec3::new(0.0, 0.0, -5.0 * 0.4946)) < 5e-3, "{place}");
    assert_eq!(aim(from - ROOM.y * Vec3::Z, Vec3::NEG_Z), None, "behind the wall");
    assert_eq!(aim(from - 3.0 * Vec3::Y, Vec3::NEG_Z), None, "from below the floor");
    let mut bench = Bench::new();
    let rig = with_eyes(&mut bench);
    let start = bench.get::<Transform>(rig);
    let hand = Transform::from_xyz(0.0, 1.2, -5.0);
    bench.edit(bench.hands[1], |transform: &mut Transform| *transform = hand);
    for is_pressed in [true, false] {
        bench.right(|controls| controls.stick_pressed = is_pressed);
        assert_eq!(bench.get::<Transform>(rig), start);
    }
}

#[test]
fn a_turn_leaves_the_head_in_place_and_comes_once_for_each_push() {
    let mut bench = Bench::new();
    let rig = with_eyes(&mut bench);
    let [start, at] = [bench.get::<Transform>(rig).rotation, Quat::IDENTITY];
    let place = head(&bench, rig);
    // To the right is clockwise, seen from above.
    for (frame, (aside, turns)) in
        [(0.6, 0), (0.8, -1), (1.0, -1), (0.5, -1), (0.8, -1), (0.1, -1), (0.9, -2), (0.0, -2), (-1.0, -1)]
            .into_iter()
            .enumerate()
    {
        bench.right(|controls| controls.stick.x = aside);
        let rotation = bench.get::<Transform>(rig).rotation;
        let expected = at * Quat::from_rotation_y(turns as f32 * FRAC_PI_6) * start;
        assert!(rotation.angle_between(expected) < 1e-3, "frame {frame}");
        assert!(head(&bench, rig).distance(place) < 1e-5, "frame {frame}");
    }
}
