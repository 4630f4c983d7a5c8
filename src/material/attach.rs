//! Gives volumes their box and material, and cameras the depth that volumes need.

use bevy::{
    asset::RenderAssetUsages,
    core_pipeline::prepass::DepthPrepass,
    light::{NotShadowCaster, NotShadowReceiver},
    mesh::{Indices, PrimitiveTopology},
    prelude::*,
    render::renderer::RenderDevice,
};

use super::{VolumeMaterial, volume_material::MaterialVariant};
use crate::{
    clip::{ClipCapacity, ClipSettings},
    occlusion::AmbientOcclusion,
    render::{OcclusionTexels, draws_isosurface},
    volume::{LookupTable, Volume3d, VolumeGeometry},
};

/// What the box and the material of a volume were made for.
#[derive(Component, Clone, PartialEq)]
pub(super) struct Visuals {
    volume_revision: u32,
    clip_capacity: ClipCapacity,
    depth_map_size: u32,
    variant: MaterialVariant,
}

/// Makes the box and the material of volumes that can be shown, and makes them anew when the
/// textures that the material binds are new.
pub(super) fn attach_visuals(
    mut commands: Commands,
    volumes: Query<
        (Entity, &LookupTable, &AmbientOcclusion, &GlobalTransform, Option<&Visuals>),
        With<Volume3d>,
    >,
    device: Res<RenderDevice>,
    clip_settings: Res<ClipSettings>,
    clip_capacity: Res<ClipCapacity>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<VolumeMaterial>>,
) {
    for (entity, table, occlusion, transform, current) in &volumes {
        let visuals = Visuals {
            volume_revision: table.volume_revision,
            clip_capacity: *clip_capacity,
            depth_map_size: clip_settings.depth_map_size,
            variant: MaterialVariant {
                is_mirrored: transform.affine().matrix3.determinant() < 0.0,
                texels: OcclusionTexels::of(occlusion, table.geometry.dimensions, &device),
                is_isosurface: draws_isosurface(occlusion, table.geometry.dimensions, &device),
            },
        };
        if current == Some(&visuals) {
            continue;
        }
        let material = VolumeMaterial { volume: entity, variant: visuals.variant };
        commands.entity(entity).try_insert((
            visuals,
            Mesh3d(meshes.add(box_mesh(&table.geometry))),
            MeshMaterial3d(materials.add(material)),
            NotShadowCaster,
            NotShadowReceiver,
        ));
    }
}

/// Takes the box and the material from entities that have no volume any more.
pub(super) fn detach_visuals(
    mut commands: Commands,
    orphans: Query<Entity, (With<Visuals>, Or<(Without<Volume3d>, Without<LookupTable>)>)>,
) {
    for entity in &orphans {
        commands.entity(entity).try_remove::<(
            Visuals,
            Mesh3d,
            MeshMaterial3d<VolumeMaterial>,
            NotShadowCaster,
            NotShadowReceiver,
        )>();
    }
}

/// Gives 3D cameras the depth prepass by which opaque meshes hide volumes.
pub(super) fn require_depth(
    mut commands: Commands,
    volumes: Query<(), With<Volume3d>>,
    cameras: Query<Entity, (With<Camera3d>, Without<DepthPrepass>)>,
) {
    if volumes.is_empty() {
        return;
    }
    for camera in &cameras {
        commands.entity(camera).try_insert(DepthPrepass);
    }
}

/// The box that the voxels fill, in volume space (mm), faces outwards.
fn box_mesh(geometry: &VolumeGeometry) -> Mesh {
    // Corners of each face, counter-clockwise seen from outside for a right-handed grid.
    const FACES: [[u32; 4]; 6] =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let corners = geometry.corners().map(|corner| corner.as_vec3().to_array());
    let is_mirrored = geometry.local_from_voxel.matrix3.determinant() < 0.0;
    let triangles = FACES.iter().flat_map(
        |&[a, b, c, d]| {
            if is_mirrored { [a, c, b, a, d, c] } else { [a, b, c, a, c, d] }
        },
    );
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, corners.to_vec())
        .with_inserted_indices(Indices::U32(triangles.collect()))
}
