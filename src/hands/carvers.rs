//! Carvers in hands.

use bevy::{ecs::system::SystemParam, prelude::*};

use super::{
    grabbable::HeldBy,
    hand::{Hand, HandState},
    motion::limited,
};
use crate::clip::{ClipMesh, ClipOperation};

/// A carver that the hand controls in which it is.
///
/// A carver is in a hand if it hangs from it ([`ChildOf`]), or if the hand holds it or an ancestor of it. A child has its parent's
/// pose of the same frame, and goes with the hand; its [`Transform`] is its place in the hand.
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(ClipMesh)]
pub struct HeldCarver {
    /// When the carver is active ([`ClipMesh::is_active`]).
    pub carves: CarveWhile,
    /// Shapes that [`ChangeShape`] goes through; without any the carver keeps its mesh. Each that is new costs a depth map.
    pub shapes: Vec<Handle<Mesh>>,
    /// Factor by which the carver grows in a second while [`Hand::scaling`] is 1. A higher one is quicker and harder to aim.
    pub growth_per_second: f32,
    /// Least [`Transform::scale`] (its largest component) that hands give the carver.
    pub min_scale: f32,
    /// Largest [`Transform::scale`] (its largest component) that hands give the carver.
    pub max_scale: f32,
}

impl Default for HeldCarver {
    fn default() -> Self {
        Self {
            carves: CarveWhile::default(),
            shapes: Vec::new(),
            growth_per_second: 2.0,
            min_scale: 0.01,
            max_scale: 100.0,
        }
    }
}

/// When a carver in a hand carves.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum CarveWhile {
    /// While the trigger of its hand is pulled. Outside of hands it does not carve.
    #[default]
    Triggered,
    /// As [`ClipMesh::is_active`] says; hands leave that alone.
    Active,
}

/// Gives a carver another of its [`HeldCarver::shapes`]. An app triggers it on the carver, or on a hand for all carvers in it.
#[derive(EntityEvent, Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChangeShape {
    /// The carver or the hand.
    pub entity: Entity,
    /// Shapes to go on by; negative ones go back. The last is followed by the first.
    pub steps: i32,
}

/// Lets a carver keep what it removed, and remove what it kept. An app triggers it on the carver, or on a hand for all carvers in it.
#[derive(EntityEvent, Clone, Copy, Debug, PartialEq, Eq)]
pub struct ToggleOperation {
    /// The carver or the hand.
    pub entity: Entity,
}

/// Finds the hands that entities are in.
#[derive(SystemParam)]
pub(super) struct HandsOf<'w, 's> {
    hands: Query<'w, 's, (&'static Hand, &'static HandState)>,
    held: Query<'w, 's, &'static HeldBy>,
    parents: Query<'w, 's, &'static ChildOf>,
}

impl HandsOf<'_, '_> {
    /// The nearest hand up the hierarchy, or the hands that hold the nearest thing.
    fn of(&self, entity: Entity) -> Vec<Entity> {
        let found = [entity].into_iter().chain(self.parents.iter_ancestors(entity)).find_map(|entity| {
            let held_by = || Some(self.held.get(entity).ok()?.hands().to_vec());
            if self.hands.contains(entity) { Some(vec![entity]) } else { held_by() }
        });
        found.unwrap_or_default()
    }

    fn states_of(&self, entity: Entity) -> impl Iterator<Item = (&Hand, &HandState)> {
        self.of(entity).into_iter().filter_map(|hand| self.hands.get(hand).ok())
    }
}

/// Makes carvers active while their triggers are pulled.
pub(super) fn switch_carvers(mut carvers: Query<(Entity, &HeldCarver, &mut ClipMesh)>, hands: HandsOf) {
    for (entity, carver, mut clip_mesh) in &mut carvers {
        if carver.carves != CarveWhile::Triggered {
            continue;
        }
        let is_active = hands.states_of(entity).any(|(_, state)| state.is_triggered);
        if clip_mesh.is_active != is_active {
            clip_mesh.is_active = is_active;
        }
    }
}

/// Lets carvers grow and shrink about their origins.
pub(super) fn scale_carvers(
    mut carvers: Query<(Entity, &HeldCarver, &mut Transform)>,
    hands: HandsOf,
    time: Res<Time>,
) {
    for (entity, carver, mut transform) in &mut carvers {
        let speed: f32 = hands.states_of(entity).map(|(hand, _)| hand.scaling.clamp(-1.0, 1.0)).sum();
        let factor = f64::from(carver.growth_per_second).powf(f64::from(speed * time.delta_secs()));
        if speed == 0.0 || !factor.is_normal() {
            continue;
        }
        let factor = limited(factor, transform.scale, carver.min_scale, carver.max_scale);
        let scale = (transform.scale.as_dvec3() * factor).as_vec3();
        if scale != transform.scale {
            transform.scale = scale;
        }
    }
}

pub(super) fn change_shape(
    change: On<ChangeShape>,
    mut carvers: Query<(Entity, &HeldCarver, &mut Mesh3d)>,
    hands: HandsOf,
) {
    for (entity, carver, mut mesh) in &mut carvers {
        if entity != change.entity && !hands.of(entity).contains(&change.entity) {
            continue;
        }
        let count = carver.shapes.len() as i64;
        let now = carver.shapes.iter().position(|shape| *shape == mesh.0);
        // A mesh that is none of the shapes comes before the first.
        let now = now.map_or(if change.steps > 0 { -1 } else { 0 }, |index| index as i64);
        let next = (now + i64::from(change.steps)).checked_rem_euclid(count);
        if let Some(shape) = next.and_then(|index| carver.shapes.get(index as usize)) {
            mesh.set_if_neq(Mesh3d(shape.clone()));
        }
    }
}

pub(super) fn toggle_operation(
    toggle: On<ToggleOperation>,
    mut carvers: Query<(Entity, &mut ClipMesh), With<HeldCarver>>,
    hands: HandsOf,
) {
    for (entity, mut clip_mesh) in &mut carvers {
        if entity == toggle.entity || hands.of(entity).contains(&toggle.entity) {
            clip_mesh.operation = match clip_mesh.operation {
                ClipOperation::Subtract => ClipOperation::Intersect,
                ClipOperation::Intersect => ClipOperation::Subtract,
            };
        }
    }
}
