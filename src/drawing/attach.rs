//! Gives every volume the child entity whose box is drawn.

use bevy::{
    camera::{primitives::Aabb, visibility::RenderLayers},
    prelude::*,
};

use super::{pipeline::DrawVariant, variants::DrawnVariants};
use crate::{
    occlusion::{FittedOcclusion, ShownOcclusion, VolumeShading},
    render::{CompilesInBackground, MethodPipelines},
    volume::{DrawnBox, LookupTable, VolumeBox, WORLD_UNITS_PER_MM},
};

/// Makes a child with a box for every volume that can be shown, and decides which occlusion it shows. Leaves the user's
/// own components on the volume's entity alone.
pub(super) fn attach_boxes(
    mut commands: Commands,
    mut volumes: Query<(
        Entity,
        &LookupTable,
        (&FittedOcclusion, &VolumeShading, Option<&mut ShownOcclusion>),
        &GlobalTransform,
        Option<&RenderLayers>,
        Option<&VolumeBox>,
    )>,
    boxes: Query<(&ChildOf, &DrawnBox, Option<&RenderLayers>)>,
    in_background: Res<CompilesInBackground>,
    methods: Res<MethodPipelines>,
    variants: Res<DrawnVariants>,
) {
    for (entity, table, (fitted, shading, shown), transform, layers, volume_box) in &mut volumes {
        // A `VolumeBox` that was copied with its entity names the child of the original.
        let child = volume_box.map(|volume_box| volume_box.0);
        let there = child.and_then(|child| boxes.get(child).ok()).filter(|(of, ..)| of.parent() == entity);
        let drawn = DrawnBox(table.geometry);
        let child = match (child, there) {
            (Some(child), Some((_, current, child_layers))) => {
                if child_layers != layers {
                    set_layers(&mut commands.entity(child), layers);
                }
                (*current != drawn).then_some(child)
            }
            _ => {
                let to_world = Transform::from_scale(Vec3::splat(WORLD_UNITS_PER_MM));
                // Transforms have already been propagated in this frame.
                let place = transform.mul_transform(to_world);
                let child = commands.spawn((Name::new("volume box"), to_world, place, ChildOf(entity))).id();
                set_layers(&mut commands.entity(child), layers);
                commands.entity(entity).try_insert(VolumeBox(child));
                Some(child)
            }
        };
        if let Some(child) = child {
            let bounds = Aabb::enclosing(table.geometry.corners().map(|corner| corner.as_vec3()));
            commands.entity(child).try_insert((drawn, bounds.unwrap_or_default()));
        }
        let by_gradient = table.last_gradient.is_some();
        // The computed and the drawn occlusion change in the same frame.
        let are_there = methods.are_there_for(&fitted.occlusion.method)
            & variants.are_there_for(DrawVariant::of(&fitted.occlusion, shading, by_gradient));
        let VolumeShading { reconstruction, lighting, outline_rays, .. } = *shading;
        let fitted = fitted.clone();
        let new = || ShownOcclusion { fitted, reconstruction, lighting, by_gradient, outline_rays };
        match shown {
            Some(mut shown) if are_there || !in_background.0 => {
                shown.set_if_neq(new());
            }
            Some(_) => {}
            None => {
                commands.entity(entity).try_insert(new());
            }
        }
    }
}

fn set_layers(entity: &mut EntityCommands, layers: Option<&RenderLayers>) {
    match layers {
        Some(layers) => entity.try_insert(layers.clone()),
        None => entity.try_remove::<RenderLayers>(),
    };
}

/// Removes the child of entities that no longer have a volume.
pub(super) fn detach_boxes(
    mut commands: Commands,
    orphans: Query<(Entity, &VolumeBox), Without<LookupTable>>,
) {
    for (entity, child) in &orphans {
        commands.entity(child.0).try_despawn();
        commands.entity(entity).try_remove::<(VolumeBox, ShownOcclusion)>();
    }
}
