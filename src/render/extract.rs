//! From the main world to the render world: the scene as this frame needs it.

use bevy::{
    math::Affine3A,
    platform::collections::HashSet,
    prelude::*,
    render::{Extract, sync_world::MainEntity},
};

use crate::{
    clip::{ClipCamera, ClipFrame, ClipMesh, ClipSettings, MAX_CARVERS},
    diagnostics::{CountWork, TimePassesByClock},
    occlusion::{AmbientOcclusion, VolumeShading},
    volume::{LookupTable, Volume, Volume3d, VolumeGeometry},
};

/// All volumes and carvers, rebuilt every frame.
#[derive(Resource, Default)]
pub(crate) struct ExtractedScene {
    pub volumes: Vec<ExtractedVolume>,
    pub carvers: Vec<ExtractedCarver>,
    pub clip_settings: ClipSettings,
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
}

impl ExtractedVolume {
    /// The occlusion reach in world units: a ball of this radius in the world contains the reach
    /// in volume space, however the volume is scaled.
    pub fn reach_world(&self) -> f32 {
        let matrix = self.world_from_local.matrix3;
        // The Frobenius norm bounds the largest stretch; a uniform scale has it exactly.
        let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(Vec3A::length);
        let longest = columns.into_iter().fold(0.0, f32::max);
        let orthogonal = (matrix.transpose() * matrix).abs_diff_eq(
            Mat3A::from_diagonal(Vec3::from_array(columns.map(|c| c * c))),
            longest * longest * 1e-4,
        );
        let stretch = if orthogonal {
            longest
        } else {
            columns.iter().map(|c| c * c).sum::<f32>().sqrt()
        };
        // Rounding must not make the reach too short.
        self.occlusion.reach_mm(self.geometry.spacing_mm) as f32 * stretch * 1.001
    }
}

pub(crate) struct ExtractedCarver {
    pub entity: Entity,
    pub clip_mesh: ClipMesh,
    pub mesh: AssetId<Mesh>,
    pub frame: ClipFrame,
    pub revision: u32,
    pub world_from_local: Affine3A,
}

/// Copies what the passes need. A volume without its table is not ready to be shown.
pub(crate) fn extract_scene(
    mut scene: ResMut<ExtractedScene>,
    assets: Extract<Res<Assets<Volume>>>,
    volumes: Extract<
        Query<(
            Entity,
            &Volume3d,
            &LookupTable,
            &AmbientOcclusion,
            &VolumeShading,
            &GlobalTransform,
        )>,
    >,
    carvers: Extract<Query<(Entity, &ClipMesh, &Mesh3d, &ClipCamera, &GlobalTransform)>>,
    clip_settings: Extract<Res<ClipSettings>>,
    count_work: Extract<Res<CountWork>>,
    time_by_clock: Extract<Res<TimePassesByClock>>,
    mut warned: Local<bool>,
) {
    scene.clip_settings = clip_settings.clone();
    scene.count_work = count_work.0;
    scene.time_by_clock = time_by_clock.0;
    scene.volumes.clear();
    scene.volumes.extend(volumes.iter().filter_map(
        |(entity, volume, table, occlusion, shading, transform)| {
            let world_from_local = transform.affine();
            (world_from_local.is_finite() && world_from_local.matrix3.determinant() != 0.0).then_some(())?;
            Some(ExtractedVolume {
                entity: entity.into(),
                asset: volume.id(),
                geometry: VolumeGeometry::of(assets.get(&volume.0)?),
                table: table.clone(),
                occlusion: occlusion.clone(),
                shading: shading.clone(),
                world_from_local,
            })
        },
    ));
    scene.carvers.clear();
    scene.carvers.extend(
        carvers
            .iter()
            .filter_map(|(entity, clip_mesh, mesh, camera, transform)| {
                let world_from_local = transform.affine();
                (world_from_local.is_finite() && world_from_local.matrix3.determinant() != 0.0)
                    .then_some(())?;
                Some(ExtractedCarver {
                    entity,
                    clip_mesh: clip_mesh.clone(),
                    mesh: mesh.id(),
                    frame: camera.frame,
                    revision: camera.revision,
                    world_from_local,
                })
            }),
    );
    // The same carvers act in every frame, whatever order a query gives.
    scene.carvers.sort_unstable_by_key(|carver| carver.entity);
    if scene.carvers.len() > MAX_CARVERS && !*warned {
        *warned = true;
        warn!(
            "{} clip meshes: only the first {MAX_CARVERS} carve",
            scene.carvers.len()
        );
    }
    scene.carvers.truncate(MAX_CARVERS);
}

impl ExtractedScene {
    /// The entities of all carvers.
    pub fn carver_entities(&self) -> HashSet<Entity> {
        self.carvers.iter().map(|carver| carver.entity).collect()
    }
}
