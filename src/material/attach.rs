//! Gives volumes the child that draws them.

use bevy::{
    asset::RenderAssetUsages,
    camera::visibility::RenderLayers,
    light::{NotShadowCaster, NotShadowReceiver},
    mesh::{Indices, PrimitiveTopology},
    prelude::*,
    render::renderer::RenderDevice,
};

use super::{VolumeMaterial, volume_material::MaterialVariant, warm_up::WarmUps};
use crate::{
    clip::{ClipCapacity, ClipSettings},
    occlusion::FittedOcclusion,
    render::{OcclusionTexels, draws_isosurface},
    volume::{LookupTable, VolumeBox, VolumeGeometry, WORLD_UNITS_PER_MM},
};

/// What the child's mesh and material were made for.
#[derive(Component, Clone, PartialEq)]
pub(super) struct Visuals {
    geometry: VolumeGeometry,
    bindings: Bindings,
}

/// What the material binds, and how.
#[derive(Clone, PartialEq)]
struct Bindings {
    volume_revision: u32,
    clip_capacity: ClipCapacity,
    depth_map_size: u32,
    variant: MaterialVariant,
}

/// Makes a child with box and material for every volume that can be shown, and makes these anew when the textures
/// that the material binds are new. Nothing is put on the volume's own entity that is the user's.
pub(super) fn attach_visuals(
    mut commands: Commands,
    volumes: Query<(
        Entity,
        &LookupTable,
        &FittedOcclusion,
        &GlobalTransform,
        Option<&RenderLayers>,
        Option<&VolumeBox>,
    )>,
    boxes: Query<(&ChildOf, &Visuals, Option<&RenderLayers>)>,
    clip_settings: Res<ClipSettings>,
    clip_capacity: Res<ClipCapacity>,
    device: Res<RenderDevice>,
    mut warm_ups: WarmUps,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<VolumeMaterial>>,
) {
    // After a device is lost, its meshes are gone: nobody else has their triangles.
    let is_new_device = device.is_changed();
    for (entity, table, fitted, transform, layers, volume_box) in &volumes {
        let variant = MaterialVariant {
            is_mirrored: transform.affine().matrix3.determinant() < 0.0,
            texels: OcclusionTexels::of(&fitted.occlusion),
            is_isosurface: draws_isosurface(&fitted.occlusion),
        };
        let mut visuals = Visuals {
            geometry: table.geometry,
            bindings: Bindings {
                volume_revision: table.volume_revision,
                clip_capacity: *clip_capacity,
                depth_map_size: clip_settings.depth_map_size,
                variant,
            },
        };
        // One that was copied with its entity belongs to the original.
        let child = volume_box.map(|volume_box| volume_box.0);
        let there = child.and_then(|child| boxes.get(child).ok()).filter(|(of, ..)| of.parent() == entity);
        let (child, current) = match (child, there) {
            (Some(child), Some((_, current, child_layers))) => {
                if child_layers != layers {
                    set_layers(&mut commands.entity(child), layers);
                }
                (child, Some(current))
            }
            _ => {
                let to_world = Transform::from_scale(Vec3::splat(WORLD_UNITS_PER_MM));
                // Transforms have been propagated before.
                let place = transform.mul_transform(to_world);
                let bundle = (
                    Name::new("volume box"),
                    to_world,
                    place,
                    NotShadowCaster,
                    NotShadowReceiver,
                    ChildOf(entity),
                );
                let child = commands.spawn(bundle).id();
                set_layers(&mut commands.entity(child), layers);
                commands.entity(entity).try_insert(VolumeBox(child));
                (child, None)
            }
        };
        if let Some(current) = current {
            let shown = current.bindings.variant;
            let wanted = VolumeMaterial { volume: entity, variant };
            if !warm_ups.are_done(child, shown, wanted, &table.geometry, &mut meshes, &mut materials) {
                visuals.bindings.variant = shown;
            }
        }
        if current == Some(&visuals) && !is_new_device {
            continue;
        }
        let mut child = commands.entity(child);
        if current.is_none_or(|current| current.geometry != visuals.geometry) || is_new_device {
            child.try_insert(Mesh3d(meshes.add(box_mesh(&table.geometry))));
        }
        if current.is_none_or(|current| current.bindings != visuals.bindings) {
            let variant = visuals.bindings.variant;
            child.try_insert(MeshMaterial3d(materials.add(VolumeMaterial { volume: entity, variant })));
        }
        child.try_insert(visuals);
    }
}

fn set_layers(entity: &mut EntityCommands, layers: Option<&RenderLayers>) {
    match layers {
        Some(layers) => entity.try_insert(layers.clone()),
        None => entity.try_remove::<RenderLayers>(),
    };
}

/// Takes the child from entities that have no volume any more.
pub(super) fn detach_visuals(
    mut commands: Commands,
    orphans: Query<(Entity, &VolumeBox), Without<LookupTable>>,
) {
    for (entity, child) in &orphans {
        commands.entity(child.0).try_despawn();
        commands.entity(entity).try_remove::<VolumeBox>();
    }
}

/// The box that the voxels fill, in volume space (mm), faces outwards.
pub(super) fn box_mesh(geometry: &VolumeGeometry) -> Mesh {
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
    // The renderer alone has its triangles: pointers meet what lies behind the box.
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::RENDER_WORLD)
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, corners.to_vec())
        .with_inserted_indices(Indices::U32(triangles.collect()))
}
