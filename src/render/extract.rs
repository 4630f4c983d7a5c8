//! From the main world to the render world: the scene as this frame needs it.

use bevy::{
    math::Affine3A,
    platform::collections::HashSet,
    prelude::*,
    render::{Extract, sync_world::MainEntity},
};

use crate::{
    clip::{ClipCamera, ClipCapacity, ClipFrame, ClipMesh, ClipSettings, MAX_CARVERS},
    diagnostics::{CountWork, TimePassesByClock},
    occlusion::{AmbientOcclusion, DirectOcclusion, OcclusionMethod, Shortcuts, VolumeShading},
    volume::{LookupTable, ShownVolume, Volume, VolumeGeometry, longest_stretch},
};

/// All volumes and carvers, rebuilt every frame.
#[derive(Resource, Default)]
pub(crate) struct ExtractedScene {
    pub volumes: Vec<ExtractedVolume>,
    pub carvers: Vec<ExtractedCarver>,
    pub clip_settings: ClipSettings,
    pub clip_capacity: ClipCapacity,
    pub shortcuts: Shortcuts,
    pub count_work: bool,
    pub time_by_clock: bool,
}

pub(crate) struct ExtractedVolume {
    pub entity: MainEntity,
    pub asset: AssetId<Volume>,
    pub geometry: VolumeGeometry,
    pub table: LookupTable,
    pub occlusion: AmbientOcclusion,
    pub shading: VolumeShading,
    pub world_from_local: Affine3A,
    /// Whether it has a place in the world: a collapsed volume keeps what it has, and waits.
    pub is_placed: bool,
}

/// How far a carver acts on voxels, as radii of balls in the world.
#[derive(Clone, Copy, Default)]
pub(crate) struct Influence {
    /// Contains the occlusion reach around a voxel.
    pub reach_world: f32,
    /// Contains all points that read a voxel.
    pub footprint_world: f32,
}

impl Influence {
    pub fn max(self, other: Self) -> Self {
        Self {
            reach_world: self.reach_world.max(other.reach_world),
            footprint_world: self.footprint_world.max(other.footprint_world),
        }
    }
}

impl ExtractedVolume {
    /// How views shade it by direct occlusion, if they do; then they draw it, and the material does not.
    pub fn direct(&self) -> Option<DirectOcclusion> {
        match self.occlusion.method {
            OcclusionMethod::Direct(settings) if self.shading.mode.uses_occlusion() => Some(settings),
            _ => None,
        }
    }

    /// The influence on this volume, however it is scaled.
    pub fn influence(&self) -> Influence {
        // Rounding must not make a length too short.
        let stretch = longest_stretch(self.world_from_local.matrix3.as_dmat3()) as f32 * 1.001;
        Influence {
            reach_world: self.occlusion.reach_mm(&self.geometry) as f32 * stretch,
            footprint_world: self.occlusion.footprint_mm(&self.geometry) as f32 * stretch,
        }
    }
}

pub(crate) struct ExtractedCarver {
    pub entity: Entity,
    pub clip_mesh: ClipMesh,
    pub mesh: AssetId<Mesh>,
    pub frame: ClipFrame,
    pub revision: u32,
    pub world_from_local: Affine3A,
    /// Whether it has a place in the world: a collapsed carver keeps its maps, and carves nothing.
    pub is_placed: bool,
}

/// Copies what the passes need. A volume without its table is not ready to be shown.
pub(crate) fn extract_scene(
    mut scene: ResMut<ExtractedScene>,
    volumes: Extract<
        Query<(Entity, &ShownVolume, &LookupTable, &AmbientOcclusion, &VolumeShading, &GlobalTransform)>,
    >,
    carvers: Extract<Query<(Entity, &ClipMesh, &ClipCamera, &GlobalTransform)>>,
    clip_settings: Extract<Res<ClipSettings>>,
    clip_capacity: Extract<Res<ClipCapacity>>,
    shortcuts: Extract<Res<Shortcuts>>,
    count_work: Extract<Res<CountWork>>,
    time_by_clock: Extract<Res<TimePassesByClock>>,
    mut warned: Local<bool>,
) {
    scene.clip_settings = clip_settings.clone();
    scene.clip_capacity = **clip_capacity;
    scene.shortcuts = **shortcuts;
    scene.count_work = count_work.0;
    scene.time_by_clock = time_by_clock.0;
    scene.volumes.clear();
    scene.volumes.extend(volumes.iter().filter_map(
        |(entity, volume, table, occlusion, shading, transform)| {
            Some(ExtractedVolume {
                entity: entity.into(),
                asset: volume.volume.as_ref()?.id(),
                geometry: table.geometry,
                table: table.clone(),
                occlusion: occlusion.clamped(),
                shading: shading.clone(),
                world_from_local: transform.affine(),
                is_placed: is_invertible(transform),
            })
        },
    ));
    scene.carvers.clear();
    scene.carvers.extend(carvers.iter().filter_map(|(entity, clip_mesh, camera, transform)| {
        Some(ExtractedCarver {
            entity,
            clip_mesh: clip_mesh.clone(),
            mesh: camera.mesh,
            frame: camera.frame?,
            revision: camera.revision,
            world_from_local: transform.affine(),
            is_placed: is_invertible(transform),
        })
    }));
    // The same carvers act in every frame, whatever order a query gives.
    scene.carvers.sort_unstable_by_key(|carver| carver.entity);
    if scene.carvers.len() > MAX_CARVERS && !*warned {
        *warned = true;
        warn!("{} clip meshes: only the first {MAX_CARVERS} carve", scene.carvers.len());
    }
    scene.carvers.truncate(MAX_CARVERS);
}

fn is_invertible(transform: &GlobalTransform) -> bool {
    let affine = transform.affine();
    let determinant = affine.matrix3.determinant();
    affine.is_finite() && determinant != 0.0 && determinant.is_finite()
}

impl ExtractedScene {
    /// The entities of all carvers.
    pub fn carver_entities(&self) -> HashSet<Entity> {
        self.carvers.iter().map(|carver| carver.entity).collect()
    }
}
