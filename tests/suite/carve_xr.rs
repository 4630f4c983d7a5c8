//! Parts of the `carve_xr` example that need neither window nor headset: controls, the rig, the panel's pointer, carvers.

use bevy::{camera::primitives::Aabb, math::Affine3A, prelude::*};
use bevy_contextual_ao::prelude::*;
use core::f32::consts::{FRAC_PI_2, FRAC_PI_6};

/// Modules of the `carve_xr` example, as its own main file has them.
#[allow(dead_code, reason = "some of it is for the window")]
#[path = "../../examples/carve_xr"]
mod example {
    use bevy_contextual_ao::prelude::Quality;

    pub mod carvers;
    pub mod controls;
    pub mod frame_rate;
    pub mod rig;
    pub mod shapes;

    pub mod wrist {
        pub mod pointer;
        pub mod surface;
    }

    /// Command-line arguments that the modules read.
    #[derive(bevy::prelude::Resource)]
    pub struct Arguments {
        pub lowest: Quality,
        pub pace: bool,
    }
}

use example::{
    carvers::{CarversPlugin, Left, RemoveAll},
    controls::{Controls, ControlsPlugin, LeaveHere, PanelPointing, Side, beyond_dead_zone},
    frame_rate::target_ms,
    rig::{Eye, ROOM, Rig, RigPlugin, arc, landing},
    wrist::{
        pointer::{PanelPointer, Pointed, point, pointed, ray_hit, touched},
        surface::{PLACE, Panel, SIZE},
    },
};

/// Events of hands: names, in order.
#[derive(Resource, Default)]
struct Told(Vec<&'static str>);

/// The example without a renderer, and its hands: left, right.
struct Bench {
    app: App,
    hands: [Entity; 2],
}

impl Bench {
    fn new() -> Self {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, AssetPlugin::default(), TransformPlugin))
            .add_plugins((bevy::mesh::MeshPlugin, ContextualAoPlugin))
            .init_asset::<StandardMaterial>()
            .init_resource::<Told>()
            .init_resource::<PanelPointer>()
            .add_plugins((ControlsPlugin, RigPlugin, CarversPlugin))
            .add_systems(Update, point.in_set(PanelPointing))
            .add_observer(|_: On<ChangeShape>, mut told: ResMut<Told>| told.0.push("shape"))
            .add_observer(|_: On<ToggleOperation>, mut told: ResMut<Told>| told.0.push("operation"))
            .add_observer(|_: On<LeaveHere>, mut told: ResMut<Told>| told.0.push("leave"));
        app.update();
        let world = app.world_mut();
        let mut hands = world.query::<(Entity, &Controls)>();
        let hands = [Side::Left, Side::Right].map(|side| {
            let found = hands.iter(world).find(|(_, controls)| controls.side == side);
            found.expect("the rig has both hands").0
        });
        let mut bench = Self { app, hands };
        for hand in hands {
            bench.edit(hand, |controls: &mut Controls| controls.is_tracked = true);
        }
        bench
    }

    fn get<C: Component + Clone>(&self, entity: Entity) -> C {
        self.app.world().get::<C>(entity).expect("the component is there").clone()
    }

    fn edit<C: Component<Mutability = bevy::ecs::component::Mutable>>(
        &mut self,
        entity: Entity,
        edit: impl FnOnce(&mut C),
    ) {
        edit(&mut self.app.world_mut().get_mut::<C>(entity).expect("the component is there"));
    }

    /// Sets the right hand's controls, and runs a frame.
    fn right(&mut self, edit: impl FnOnce(&mut Controls)) {
        self.edit(self.hands[1], edit);
        self.app.update();
    }

    fn told(&mut self) -> Vec<&'static str> {
        core::mem::take(&mut self.app.world_mut().resource_mut::<Told>().0)
    }

    fn single<F: bevy::ecs::query::QueryFilter>(&mut self) -> Entity {
        let world = self.app.world_mut();
        world.query_filtered::<Entity, F>().single(world).expect("there is one")
    }

    /// The carver in the right hand.
    fn carver(&self) -> Entity {
        let world = self.app.world();
        let mut children = world.get::<Children>(self.hands[1]).into_iter().flatten();
        *children.find(|child| world.get::<HeldCarver>(**child).is_some()).expect("it has a carver")
    }

    fn in_world(&self, entity: Entity) -> Affine3A {
        self.get::<GlobalTransform>(entity).affine()
    }
}

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

#[test]
fn rays_hit_the_panel_from_the_front() {
    let from = Vec3::new(0.01, 0.3, 0.4);
    for (place, on_panel) in [
        (Vec2::splat(0.5), Vec2::ZERO),
        (Vec2::new(0.1, 0.1), Vec2::new(-0.4, 0.4)),
        (Vec2::new(0.9, 0.75), Vec2::new(0.4, -0.25)),
    ] {
        let target = (SIZE * on_panel).extend(0.0);
        let hit = ray_hit(from, target - from).expect("it hits");
        assert!(hit.distance(place) < 1e-5, "{hit} for {place}");
        let behind = from * Vec3::new(1.0, 1.0, -1.0);
        assert_eq!(ray_hit(behind, target - behind), None);
        assert_eq!(ray_hit(from, from - target), None, "it points away");
    }
    assert_eq!(ray_hit(from, (SIZE * Vec2::new(0.55, 0.0)).extend(0.0) - from), None);
    assert_eq!(ray_hit(from, Vec3::X), None, "it never gets there");
}

#[test]
fn a_finger_presses_near_the_panel_and_lets_go_farther_away() {
    let tip = |distance: f32| (SIZE * Vec2::new(0.25, 0.25)).extend(distance);
    let mut was = false;
    for (distance, expected) in [
        (0.05, Some(false)),
        (0.015, Some(false)),
        (0.009, Some(true)),
        (-0.004, Some(true)),
        (0.019, Some(true)),
        (0.021, Some(false)),
        (0.015, Some(false)),
        (0.2, None),
    ] {
        let pointed = touched(tip(distance), was);
        assert_eq!(pointed.map(|pointed| pointed.is_pressed), expected, "{distance}");
        assert!(pointed.is_none_or(|pointed| pointed.place.distance(Vec2::new(0.75, 0.25)) < 1e-5));
        was = pointed.is_some_and(|pointed| pointed.is_pressed);
    }
    assert_eq!(touched(tip(0.0) + Vec3::X, false), None);
    // The ray goes elsewhere: a near finger counts.
    let controls = Controls {
        finger: Some(Vec3::new(0.0, 0.0, -0.1)),
        aim: Isometry3d::from_rotation(Quat::from_rotation_x(FRAC_PI_2)),
        is_tracked: true,
        ..Controls::new(Side::Right)
    };
    let before = Affine3A::from_translation(Vec3::new(0.0, 0.0, 0.105));
    assert_eq!(pointed(before, &controls, None), Some(Pointed { place: Vec2::splat(0.5), is_pressed: true }));
    assert_eq!(pointed(before, &Controls { finger: None, ..controls }, None), None);
    assert_eq!(pointed(before, &Controls { is_tracked: false, ..controls }, None), None);
}

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

#[test]
fn carvers_that_are_left_stay_in_the_volume() {
    let mut bench = Bench::new();
    let volume = Transform::from_xyz(0.1, 1.1, 0.0).with_scale(Vec3::splat(1.3));
    let bounds = Aabb::from_min_max(Vec3::splat(-0.1), Vec3::splat(0.1));
    let volume =
        bench.app.world_mut().spawn((Volume3d::default(), volume, bounds, Grabbable::default())).id();
    let [hand, carver] = [bench.hands[1], bench.carver()];
    let rig = bench.single::<With<Rig>>();
    let from_rig = bench.get::<Transform>(rig).compute_affine().inverse();
    let put = |bench: &mut Bench, place: Vec3, turn: f32| {
        let pose = Transform::from_translation(from_rig.transform_point3(place));
        bench.edit(hand, |transform: &mut Transform| {
            *transform = pose.with_rotation(Quat::from_rotation_z(turn))
        });
    };
    put(&mut bench, Vec3::new(0.15, 1.15, 0.12), 0.3);
    bench.right(|controls| controls.operation = true);
    bench.right(|controls| controls.trigger = 1.0);
    let cut = bench.in_world(carver);
    // The hand closes while it carves: it leaves the carver, and grabs nothing.
    bench.right(|controls| controls.grip = 1.0);
    assert!(bench.app.world().get::<Holds>(hand).is_none());
    bench.right(|controls| (controls.trigger, controls.grip) = (0.0, 0.0));
    assert!(!bench.get::<ClipMesh>(carver).is_active);
    let left = bench.single::<With<Left>>();
    assert!(bench.in_world(left).abs_diff_eq(cut, 1e-5), "{} for {cut}", bench.in_world(left));
    assert_eq!(bench.get::<ClipMesh>(left), ClipMesh::intersect());
    assert_eq!(bench.get::<Mesh3d>(left), bench.get::<Mesh3d>(carver));
    // The hand grabs the volume, and turns it.
    let in_volume = |bench: &Bench| bench.in_world(volume).inverse() * bench.in_world(left);
    let before = (bench.in_world(volume), in_volume(&bench));
    put(&mut bench, Vec3::new(0.12, 1.12, 0.05), 0.0);
    bench.right(|controls| controls.grip = 1.0);
    assert!(bench.app.world().get::<Holds>(hand).is_some());
    put(&mut bench, Vec3::new(0.4, 1.0, 0.3), 1.1);
    bench.app.update();
    assert!(!bench.in_world(volume).abs_diff_eq(before.0, 0.1), "the volume has moved");
    assert!(in_volume(&bench).abs_diff_eq(before.1, 1e-5));
    // The panel leaves another one where the hand cut last, wherever the hand is.
    bench.app.world_mut().trigger(LeaveHere { entity: hand });
    bench.app.update();
    let world = bench.app.world_mut();
    let places: Vec<_> = world.query_filtered::<&Transform, With<Left>>().iter(world).copied().collect();
    assert!(places.len() == 2 && places[0] == places[1], "{places:?}");
    world.trigger(RemoveAll);
    bench.app.update();
    assert!(bench.app.world().get_entity(left).is_err());
}

#[test]
fn frames_may_take_a_third_longer_than_the_display() {
    for (interval_ms, expected_ms) in [(Some(11.1), 14.8), (Some(0.0), 22.22), (None, 22.22)] {
        assert!((target_ms(interval_ms) - expected_ms).abs() < 0.01, "{interval_ms:?}");
    }
}
