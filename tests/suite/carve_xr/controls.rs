//! What controls do.

use super::*;

#[test]
fn sticks_have_a_dead_zone() {
    for (deflection, expected) in [(0.0, 0.0), (0.2, 0.0), (0.6, 0.5), (1.0, 1.0), (1.2, 1.0)] {
        for sign in [-1.0, 1.0] {
            let beyond = beyond_dead_zone(sign * deflection);
            assert!((beyond - sign * expected).abs() < 1e-6, "{deflection}: {beyond}");
        }
    }
    assert_eq!(beyond_dead_zone(f32::NAN).abs(), 0.0);
    let mut bench = Bench::new();
    for (stick, is_pressed, expected) in [
        (Vec2::new(0.0, 0.6), false, 0.5),
        (Vec2::new(0.0, -0.19), false, 0.0),
        // It teleports, or turns.
        (Vec2::new(0.0, 0.6), true, 0.0),
        (Vec2::new(0.65, 0.6), false, 0.0),
    ] {
        bench.right(|controls| (controls.stick, controls.stick_pressed) = (stick, is_pressed));
        let scaling = bench.get::<Hand>(bench.hands[1]).scaling;
        assert!((scaling - expected).abs() < 1e-6, "{stick} {is_pressed}: {scaling}");
    }
}

#[test]
fn buttons_act_once_for_each_press() {
    let mut bench = Bench::new();
    let pressed = [[true, false], [true, true], [true, true], [false, true], [true, false]];
    let expected = [vec!["shape"], vec!["operation"], vec![], vec![], vec!["shape"]];
    for (frame, ([shape, operation], expected)) in pressed.into_iter().zip(expected).enumerate() {
        bench.right(|controls| (controls.shape, controls.operation) = (shape, operation));
        assert_eq!(bench.told(), expected, "frame {frame}");
    }
}

#[test]
fn a_hand_that_is_not_tracked_does_nothing_and_is_hidden() {
    let mut bench = Bench::new();
    let [hand, carver] = [bench.hands[1], bench.carver()];
    let pull =
        |controls: &mut Controls| (controls.trigger, controls.grip, controls.stick.y) = (1.0, 1.0, 1.0);
    bench.right(|controls| controls.trigger = 1.0);
    assert!(bench.get::<ClipMesh>(carver).is_active);
    assert_eq!(bench.get::<Visibility>(hand), Visibility::Inherited);
    bench.right(|controls| {
        pull(controls);
        (controls.shape, controls.is_tracked) = (true, false);
    });
    let Hand { grip, trigger, scaling, .. } = bench.get(hand);
    assert_eq!([grip, trigger, scaling], [0.0; 3]);
    assert!(bench.told().is_empty());
    assert!(!bench.get::<ClipMesh>(carver).is_active);
    assert_eq!(bench.get::<Visibility>(hand), Visibility::Hidden);
    // A carver that always cuts does not cut where its hand was seen last.
    bench.edit(carver, |held: &mut HeldCarver| held.carves = CarveWhile::Active);
    for is_tracked in [true, false] {
        bench.right(|controls| controls.is_tracked = is_tracked);
        assert_eq!(bench.get::<ClipMesh>(carver).is_active, is_tracked);
    }
}

/// Puts the panel on the left hand, and the right hand before it: pointing at its middle, or away from it.
fn point_at_panel(bench: &mut Bench, at_panel: bool) {
    let [left, right] = bench.hands;
    let world = bench.app.world_mut();
    if world.query::<&Panel>().iter(world).next().is_none() {
        world.spawn((Panel { context: Entity::PLACEHOLDER }, Transform::from_isometry(PLACE), ChildOf(left)));
    }
    let hold = Transform::from_xyz(-0.2, 1.1, -0.3).with_rotation(Quat::from_rotation_y(0.4));
    let away = if at_panel { 0.0 } else { 1.2 };
    let before = hold * Transform::from_isometry(PLACE) * Transform::from_xyz(0.0, 0.0, 0.3);
    bench.edit(left, |transform: &mut Transform| *transform = hold);
    bench.edit(right, |transform: &mut Transform| {
        *transform = before * Transform::from_rotation(Quat::from_rotation_y(away))
    });
}

#[test]
fn a_hand_that_points_at_the_panel_does_not_carve() {
    let mut bench = Bench::new();
    let carver = bench.carver();
    // Whether the hand points at the panel, its trigger; whether it carves then, and whether the panel is pressed.
    for (frame, (at_panel, trigger, carves, is_pressed)) in [
        (true, 0.0, false, Some(false)),
        (true, 1.0, false, Some(true)),
        // A pull that began at the panel does not carve.
        (false, 1.0, false, None),
        (false, 0.0, false, None),
        (false, 1.0, true, None),
        // One that carves carves on across the panel.
        (true, 1.0, true, None),
        (true, 0.0, false, Some(false)),
    ]
    .into_iter()
    .enumerate()
    {
        point_at_panel(&mut bench, at_panel);
        bench.right(|controls| controls.trigger = trigger);
        assert_eq!(bench.get::<ClipMesh>(carver).is_active, carves, "frame {frame}");
        let pointer = bench.app.world().resource::<PanelPointer>().0;
        assert_eq!(pointer.map(|pointed| pointed.is_pressed), is_pressed, "frame {frame}");
    }
    let place = bench.app.world().resource::<PanelPointer>().0.map(|pointed| pointed.place);
    assert!(place.is_some_and(|place| place.distance(Vec2::splat(0.5)) < 1e-4), "{place:?}");
}
