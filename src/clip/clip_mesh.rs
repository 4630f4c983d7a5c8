//! The component that turns a mesh into a carver.

use bevy::{
    ecs::entity::{EntityMapper, MapEntities},
    prelude::*,
};

/// The most carvers that can act at once: those that were spawned first. The others are told by
/// [`ClipMeshCutOff`].
pub const MAX_CARVERS: usize = 128;

/// Makes the closed mesh of this entity ([`Mesh3d`]) cut volumes.
///
/// The mesh needs no material; with one it is drawn as well. Everything else (clip camera, depth
/// and dilation maps) appears by itself and goes away with the component. Moving and rotating the
/// entity re-renders nothing. The mesh carves whether or not its [`Visibility`] shows it.
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(Transform, Visibility)]
pub struct ClipMesh {
    /// Whether the mesh carves at all. Its maps stay while it does not.
    pub is_active: bool,
    /// What becomes of the part of the volume inside the mesh.
    pub operation: ClipOperation,
    /// Which volumes the mesh carves.
    #[entities]
    pub targets: ClipTargets,
}

impl Default for ClipMesh {
    fn default() -> Self {
        Self { is_active: true, operation: default(), targets: default() }
    }
}

impl ClipMesh {
    /// A carver that keeps what is inside the mesh and removes everything else (volume probing).
    pub fn intersect() -> Self {
        Self { operation: ClipOperation::Intersect, ..default() }
    }

    /// Whether this mesh carves the volume on `entity`.
    pub fn carves(&self, entity: Entity) -> bool {
        self.is_active
            && match &self.targets {
                ClipTargets::All => true,
                ClipTargets::Only(volumes) => volumes.contains(&entity),
            }
    }
}

/// What a carver does with the part of the volume inside its mesh.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum ClipOperation {
    /// Removes what is inside the mesh.
    #[default]
    Subtract,
    /// Keeps what is inside the mesh, removes what is outside (volume probing).
    Intersect,
}

/// The volumes that a carver acts on.
#[derive(Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ClipTargets {
    /// Every volume, also those spawned later.
    #[default]
    All,
    /// Only the volumes on these entities. They are mapped with their scene.
    Only(Vec<Entity>),
}

impl MapEntities for ClipTargets {
    fn map_entities<M: EntityMapper>(&mut self, mapper: &mut M) {
        if let Self::Only(volumes) = self {
            volumes.map_entities(mapper);
        }
    }
}

/// Triggered on a [`ClipMesh`] entity whose mesh cannot carve, or cannot follow its pose and carves as
/// it is, with the reason.
#[derive(EntityEvent, Clone, Debug)]
pub struct ClipMeshFailed {
    /// The carver.
    pub entity: Entity,
    /// Why it cannot.
    pub reason: String,
}

/// Triggered on a [`ClipMesh`] entity whose mesh has more layers than
/// [`ClipSettings::max_layers`](super::ClipSettings::max_layers) allows: seen from its clip camera,
/// more pieces lie behind one another. What is behind the last but one layer is carved from its
/// nearest to its farthest surface. Or one that carves nothing, because there are [`MAX_CARVERS`] before it or
/// [`VolumeBudget`](crate::volume::VolumeBudget) has no room for it.
#[derive(EntityEvent, Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClipMeshCutOff {
    /// The carver.
    pub entity: Entity,
    /// Its mesh.
    pub mesh: AssetId<Mesh>,
    /// Layers that it has, as far as they have been counted.
    pub has_layers: u32,
    /// Layers that it gets; with 0 it carves nothing.
    pub gets_layers: u32,
}

/// The place of a carver in the order in which carvers were spawned, lowest first. Entities have no such order.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct SpawnOrder(u64);

/// Numbers carvers when they come.
pub(super) fn number_carvers(came: On<Add, ClipMesh>, mut commands: Commands, mut last: Local<u64>) {
    *last += 1;
    commands.entity(came.entity).try_insert(SpawnOrder(*last));
}

/// Warns of it, naming the mesh's file where there is one.
pub(super) fn warn_of_cut_off(cut_off: On<ClipMeshCutOff>, asset_server: Option<Res<AssetServer>>) {
    let ClipMeshCutOff { entity, mesh, has_layers, gets_layers } = cut_off.event();
    let path = asset_server.as_ref().and_then(|server| server.get_path(*mesh));
    let name = path.map_or_else(|| mesh.to_string(), |path| path.to_string());
    if *gets_layers == 0 {
        warn!(
            "the clip mesh {name} on {entity} does not carve: {MAX_CARVERS} that were spawned before it do, or \
             VolumeBudget has no room for its depth maps"
        );
        return;
    }
    warn!(
        "the clip mesh {name} on {entity} has {has_layers} layers, of which {gets_layers} are kept apart: \
         raise ClipSettings::max_layers to carve it as it is"
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::ecs::entity::EntityHashMap;

    #[test]
    fn targets_are_mapped_with_their_scene() {
        let [file, world, other] = [1, 2, 3].map(|k| Entity::from_raw_u32(k).expect("an entity"));
        let mut mesh = ClipMesh { targets: ClipTargets::Only(vec![file, other]), ..default() };
        let mut map = EntityHashMap::default();
        map.insert(file, world);
        <ClipMesh as Component>::map_entities(&mut mesh, &mut map);
        assert_eq!(mesh.targets, ClipTargets::Only(vec![world, other]));
    }
}
