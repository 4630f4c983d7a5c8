//! Gives every volume the child entity that draws it.

use bevy::{
    camera::visibility::RenderLayers,
    light::{NotShadowCaster, NotShadowReceiver},
    prelude::*,
    render::renderer::RenderDevice,
};

use super::{VolumeMaterial, box_mesh::box_mesh, volume_material::MaterialVariant, warm_up::WarmUps};
use crate::{
    clip::{ClipCapacity, ClipSettings},
    occlusion::{FittedOcclusion, ShownOcclusion},
    render::{CompilesInBackground, MethodPipelines},
    volume::{LookupTable, VolumeBox, VolumeGeometry, WORLD_UNITS_PER_MM},
};

/// The state that the child's mesh and material were made for.
#[derive(Component, Clone, PartialEq)]
pub(super) struct Visuals {
    geometry: VolumeGeometry,
    bindings: Bindings,
}

/// The state that a material's bindings and pipelines depend on.
#[derive(Clone, PartialEq)]
struct Bindings {
    volume_revision: u32,
    clip_capacity: ClipCapacity,
    depth_map_size: u32,
    variant: MaterialVariant,
}

/// Makes a child with box and material for every volume that can be shown. Makes box and material anew when the
/// textures that the material binds are new. Leaves the user's own components on the volume's entity alone.
pub(super) fn attach_visuals(
    mut commands: Commands,
    mut volumes: Query<(
        Entity,
        &LookupTable,
        (&FittedOcclusion, Option<&mut ShownOcclusion>),
        &GlobalTransform,
        Option<&RenderLayers>,
        Option<&VolumeBox>,
    )>,
    boxes: Query<(&ChildOf, &Visuals, Option<&RenderLayers>)>,
    clip_settings: Res<ClipSettings>,
    clip_capacity: Res<ClipCapacity>,
    device: Res<RenderDevice>,
    (in_background, method_pipelines): (Res<CompilesInBackground>, Res<MethodPipelines>),
    mut warm_ups: WarmUps,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<VolumeMaterial>>,
) {
    // The meshes are lost with a device: only the renderer keeps their triangles.
    let is_new_device = device.is_changed();
    for (entity, table, (fitted, shown), transform, layers, volume_box) in &mut volumes {
        let variant = MaterialVariant {
            is_mirrored: transform.affine().matrix3.determinant() < 0.0,
            texels: fitted.occlusion.texels(),
            is_isosurface: fitted.occlusion.method.settings().drawing().draws_surface,
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
        // A `VolumeBox` that was copied with its entity names the child of the original.
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
                // Transforms have already been propagated in this frame.
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
        // The computed and the drawn occlusion change in the same frame.
        let are_there = method_pipelines.are_there_for(&fitted.occlusion.method);
        let is_ready = current.filter(|_| in_background.0).is_none_or(|current| {
            let (drawn, wanted) = (current.bindings.variant, VolumeMaterial { volume: entity, variant });
            are_there && warm_ups.are_done(child, drawn, wanted, &table.geometry, &mut meshes, &mut materials)
        });
        match (shown, current) {
            (Some(mut shown), _) if is_ready => {
                shown.set_if_neq(ShownOcclusion(fitted.clone()));
            }
            (Some(_), Some(current)) => visuals.bindings.variant = current.bindings.variant,
            _ => {
                commands.entity(entity).try_insert(ShownOcclusion(fitted.clone()));
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

/// Removes the child of entities that no longer have a volume.
pub(super) fn detach_visuals(
    mut commands: Commands,
    orphans: Query<(Entity, &VolumeBox), Without<LookupTable>>,
) {
    for (entity, child) in &orphans {
        commands.entity(child.0).try_despawn();
        commands.entity(entity).try_remove::<(VolumeBox, ShownOcclusion)>();
    }
}
