//! The component that turns a mesh into a carver.

use bevy::{
    ecs::entity::{EntityMapper, MapEntities},
    prelude::*,
};

/// Largest number of carvers that can act at once: the carvers spawned first. The others get a
/// [`ClipMeshCutOff`] event.
pub const MAX_CARVERS: usize = 128;

/// Makes the closed mesh of this entity ([`Mesh3d`]) cut volumes.
///
/// The mesh needs no material; with a material it is drawn as well. The clip camera, depth maps and dilation
/// maps appear by themselves and go away with the component. Moving and rotating the entity re-renders no
/// maps. A mesh that its [`Visibility`] hides carves as well.
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(Transform, Visibility)]
pub struct ClipMesh {
    /// Whether the mesh carves. An inactive mesh keeps its maps.
    pub is_active: bool,
    /// Operation on the part of the volume inside the mesh.
    pub operation: ClipOperation,
    /// Volumes that the mesh carves.
    #[entities]
    pub targets: ClipTargets,
}

impl Default for ClipMesh {
    fn default() -> Self {
        Self { is_active: true, operation: default(), targets: default() }
    }
}

impl ClipMesh {
    /// Makes a carver that keeps the part inside the mesh and removes the part outside (volume probing).
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

/// Operation of a carver on the part of the volume inside its mesh.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum ClipOperation {
    /// Removes the part inside the mesh.
    #[default]
    Subtract,
    /// Keeps the part inside the mesh and removes the part outside (volume probing).
    Intersect,
}

/// The volumes that a carver acts on.
#[derive(Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ClipTargets {
    /// Every volume, including volumes spawned later.
    #[default]
    All,
    /// Only the volumes on these entities. The entities are mapped with their scene.
    Only(Vec<Entity>),
}

impl MapEntities for ClipTargets {
    fn map_entities<M: EntityMapper>(&mut self, mapper: &mut M) {
        if let Self::Only(volumes) = self {
            volumes.map_entities(mapper);
        }
    }
}

/// Triggered on a [`ClipMesh`] entity whose mesh cannot carve, or cannot follow its pose.
///
/// A mesh that cannot follow its pose carves undeformed.
#[derive(EntityEvent, Clone, Debug)]
pub struct ClipMeshFailed {
    /// The carver.
    pub entity: Entity,
    /// Reason of the failure.
    pub reason: String,
}

/// Triggered on a [`ClipMesh`] entity that gets fewer layers than its mesh has.
///
/// Seen from its clip camera, the mesh has more pieces behind one another than
/// [`ClipSettings::max_layers`](super::ClipSettings::max_layers) allows. Its last layer then reaches from the layer's
/// nearest surface to the mesh's farthest surface. A carver that gets no layer carves nothing: [`MAX_CARVERS`] were
/// spawned before it, or [`VolumeBudget`](crate::volume::VolumeBudget) has no room for it.
#[derive(EntityEvent, Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClipMeshCutOff {
    /// The carver.
    pub entity: Entity,
    /// Its mesh.
    pub mesh: AssetId<Mesh>,
    /// Layers of the mesh, as far as they have been counted.
    pub has_layers: u32,
    /// Layers that the carver gets; with 0 it carves nothing.
    pub gets_layers: u32,
}

/// Place of a carver in the order of spawning, lowest first. Entity ids have no such order.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct SpawnOrder(u64);

/// Numbers carvers as they are spawned.
pub(super) fn number_carvers(came: On<Add, ClipMesh>, mut commands: Commands, mut last: Local<u64>) {
    *last += 1;
    commands.entity(came.entity).try_insert(SpawnOrder(*last));
}

/// Logs a carver that is cut off, with the mesh's file if it has one.
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
