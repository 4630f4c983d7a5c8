//! The component that turns a mesh into a carver.

use bevy::prelude::*;

/// The most carvers that can act at once; more are ignored with a warning.
///
/// Two depth maps per carver in one texture array: wgpu guarantees 256 array layers.
pub const MAX_CARVERS: usize = 128;

/// Makes the closed mesh of this entity ([`Mesh3d`]) cut volumes.
///
/// The mesh needs no material; with one it is drawn as well. Everything else (clip camera, depth
/// and dilation maps) appears by itself and goes away with the component. Moving and rotating the
/// entity re-renders nothing. The mesh carves whether or not its [`Visibility`] shows it.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(Transform, Visibility)]
pub struct ClipMesh {
    /// What becomes of the part of the volume inside the mesh.
    pub operation: ClipOperation,
    /// Which volumes the mesh carves.
    pub targets: ClipTargets,
}

impl ClipMesh {
    /// A carver that keeps what is inside the mesh and removes everything else (volume probing).
    pub fn intersect() -> Self {
        Self { operation: ClipOperation::Intersect, ..default() }
    }

    /// Whether this mesh carves the volume on `entity`.
    pub fn carves(&self, entity: Entity) -> bool {
        match &self.targets {
            ClipTargets::All => true,
            ClipTargets::Only(volumes) => volumes.contains(&entity),
        }
    }
}

/// What a carver does with the part of the volume inside its mesh.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
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
pub enum ClipTargets {
    /// Every volume, also those spawned later.
    #[default]
    All,
    /// Only the volumes on these entities.
    Only(Vec<Entity>),
}

/// Number of carvers that the maps have room for; grows and shrinks with the clip meshes.
///
/// Counted once, in the main world: textures and what binds them follow the same number.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ClipCapacity(pub u32);

impl ClipCapacity {
    pub fn for_carvers(count: usize) -> Self {
        Self(count.clamp(1, MAX_CARVERS).next_power_of_two() as u32)
    }
}

impl Default for ClipCapacity {
    fn default() -> Self {
        Self::for_carvers(0)
    }
}

/// Settings shared by all clip cameras.
#[derive(Resource, Reflect, Clone, Debug, PartialEq)]
#[reflect(Resource, Default, Debug, Clone, PartialEq)]
pub struct ClipSettings {
    /// Width and height of a depth map in texels, rounded up to a multiple of 16.
    ///
    /// More texels follow curved and slanted surfaces closer; memory grows with the square
    /// (8 bytes per texel and carver), the time of a carve frame hardly at all.
    pub depth_map_size: u32,
}

impl Default for ClipSettings {
    fn default() -> Self {
        Self { depth_map_size: 1024 }
    }
}

/// Triggered on a [`ClipMesh`] entity whose mesh cannot carve, with the reason.
#[derive(EntityEvent, Clone, Debug)]
pub struct ClipMeshFailed {
    /// The carver.
    pub entity: Entity,
    /// Why it has no effect.
    pub reason: String,
}
