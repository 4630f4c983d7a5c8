//! A thing and two hands, without a renderer.

use bevy::{
    camera::primitives::Aabb,
    math::{DAffine3, DMat3, DQuat},
    prelude::*,
    time::TimeUpdateStrategy,
};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::random::Random;
use core::time::Duration;

/// A frame lasts a tenth of a second.
pub const FRAME_S: f32 = 0.1;

/// Parents of things: none, turned, scaled, mirrored, and mirrored along one axis, in a chain.
pub fn parents() -> Vec<Vec<Transform>> {
    let turn = Quat::from_euler(EulerRot::XYZ, 0.4, -1.1, 0.7);
    let pose = Transform::from_xyz(0.4, -0.2, 0.3).with_rotation(turn);
    vec![
        vec![],
        vec![pose],
        vec![pose, Transform::from_xyz(0.1, 0.5, 0.0).with_scale(Vec3::splat(2.5))],
        vec![pose.with_scale(Vec3::splat(-0.5))],
        vec![Transform::from_scale(Vec3::new(-1.0, 1.0, 1.0)), pose],
    ]
}

/// Events in order: whether it is a grab, the thing, the hand.
#[derive(Resource, Default)]
pub struct Events(pub Vec<(bool, Entity, Entity)>);

pub struct Bench {
    pub app: App,
    pub thing: Entity,
    pub hands: [Entity; 2],
}

impl Bench {
    /// A thing under parents, and hands that reach it from everywhere, under a parent of their own.
    pub fn new(parents: &[Transform], thing: impl Bundle) -> Self {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, AssetPlugin::default(), TransformPlugin))
            .add_plugins((bevy::mesh::MeshPlugin, ContextualAoPlugin))
            .init_resource::<Events>()
            .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f32(FRAME_S)))
            .add_observer(|grab: On<Grabbed>, mut events: ResMut<Events>| {
                events.0.push((true, grab.entity, grab.hand));
            })
            .add_observer(|release: On<Released>, mut events: ResMut<Events>| {
                events.0.push((false, release.entity, release.hand));
            });
        let world = app.world_mut();
        let mut parent = None;
        for place in parents {
            let child = world.spawn((*place, Visibility::default())).id();
            if let Some(parent) = parent {
                world.entity_mut(child).insert(ChildOf(parent));
            }
            parent = Some(child);
        }
        let thing = world.spawn((thing, Aabb::from_min_max(Vec3::splat(-0.1), Vec3::splat(0.1)))).id();
        if let Some(parent) = parent {
            world.entity_mut(thing).insert(ChildOf(parent));
        }
        let rig = Transform::from_xyz(0.2, 0.1, -0.3).with_rotation(Quat::from_rotation_y(0.8));
        let rig = world.spawn((rig, Visibility::default())).id();
        let hands = [(); 2].map(|()| world.spawn((Hand { reach: 100.0, ..default() }, ChildOf(rig))).id());
        let mut bench = Self { app, thing, hands };
        bench.app.update();
        bench
    }

    pub fn get<C: Component + Clone>(&self, entity: Entity) -> C {
        self.app.world().get::<C>(entity).cloned().expect("the component")
    }

    pub fn edit<C: Component<Mutability = bevy::ecs::component::Mutable>>(
        &mut self,
        entity: Entity,
        change: impl FnOnce(&mut C),
    ) {
        change(&mut self.app.world_mut().get_mut::<C>(entity).expect("the component"));
    }

    /// Moves a hand.
    pub fn place(&mut self, hand: usize, pose: Transform) {
        self.edit(self.hands[hand], |transform: &mut Transform| *transform = pose);
    }

    pub fn place_both(&mut self, poses: [Transform; 2]) {
        self.place(0, poses[0]);
        self.place(1, poses[1]);
    }

    /// Closes or opens hands in a frame.
    pub fn grip(&mut self, grips: [bool; 2]) {
        for (hand, grip) in self.hands.into_iter().zip(grips) {
            self.edit(hand, |hand: &mut Hand| hand.grip = f32::from(grip));
        }
        self.app.update();
    }

    /// Place in the world, in double precision.
    pub fn world(&self, entity: Entity) -> DAffine3 {
        let world = self.app.world();
        let local = world.get::<Transform>(entity).expect("a place");
        let local = DAffine3::from_scale_rotation_translation(
            local.scale.as_dvec3(),
            local.rotation.as_dquat().normalize(),
            local.translation.as_dvec3(),
        );
        world.get::<ChildOf>(entity).map_or(local, |parent| self.world(parent.parent()) * local)
    }

    /// Rotation in the world; a mirror image counts as a rotation of the image through the origin.
    pub fn rotation(&self, entity: Entity) -> DQuat {
        let world = self.app.world();
        let turn = world.get::<Transform>(entity).expect("a place").rotation.as_dquat().normalize();
        let parent =
            world.get::<ChildOf>(entity).map_or(DAffine3::IDENTITY, |parent| self.world(parent.parent()));
        let matrix = parent.matrix3 * DMat3::from_quat(turn);
        let scale = matrix.determinant().cbrt();
        DQuat::from_mat3(&DMat3::from_cols(
            matrix.x_axis / scale,
            matrix.y_axis / scale,
            matrix.z_axis / scale,
        ))
    }

    /// Hands that hold the thing.
    pub fn holders(&self) -> Vec<Entity> {
        self.app.world().get::<HeldBy>(self.thing).map_or(vec![], |held_by| held_by.hands().to_vec())
    }

    pub fn take_events(&mut self) -> Vec<(bool, Entity, Entity)> {
        core::mem::take(&mut self.app.world_mut().resource_mut::<Events>().0)
    }
}

/// A pose of a hand within a metre.
pub fn pose(random: &mut Random) -> Transform {
    Transform::from_translation(random.point()).with_rotation(random.rotation(3.0))
}

/// A thing in any pose, of an uneven scale.
pub fn thing(random: &mut Random) -> (Grabbable, Transform) {
    let scale = Vec3::new(0.7, -0.9, 1.2) * (1.2 + random.signed());
    let limits = Grabbable { min_scale: 1e-4, max_scale: 1e4, ..default() };
    (limits, pose(random).with_scale(scale))
}

/// Largest difference of the entries of two places.
pub fn difference(a: DAffine3, b: DAffine3) -> f64 {
    let pairs = a.to_cols_array().into_iter().zip(b.to_cols_array());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
