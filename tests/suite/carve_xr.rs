//! Parts of the `carve_xr` example that need neither window nor headset: controls, the rig, the panel's pointer, carvers.

mod controls;
mod pointer;
mod rig;

use bevy::{camera::primitives::Aabb, math::Affine3A, prelude::*};
use bevy_contextual_ao::prelude::*;
use core::f32::consts::{FRAC_PI_2, FRAC_PI_6};

/// Modules of the `carve_xr` example, as its own main file has them.
#[allow(dead_code, reason = "some of it is for the window")]
#[path = "../../examples/carve_xr"]
pub mod example {
    pub mod carvers;
    pub mod controls;
    pub mod frame_rate;
    pub mod headset;
    pub mod rig;
    pub mod shapes;

    pub mod wrist {
        pub mod pointer;
        pub mod surface;
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
