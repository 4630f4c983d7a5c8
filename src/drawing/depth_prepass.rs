//! Gives cameras the depth of opaque meshes, so that opaque meshes hide volumes.

use bevy::{camera::visibility::RenderLayers, core_pipeline::prepass::DepthPrepass, prelude::*};

use crate::volume::Volume3d;

/// Marks cameras whose depth prepass this module added, and may remove.
#[derive(Component)]
pub(super) struct AddedDepthPrepass;

/// Adds a depth prepass to active 3D cameras that share a render layer with a volume. Removes it from cameras that no
/// longer do.
pub(super) fn require_depth(
    mut commands: Commands,
    volumes: Query<Option<&RenderLayers>, With<Volume3d>>,
    cameras: Query<
        (Entity, &Camera, Option<&RenderLayers>, Has<DepthPrepass>, Has<AddedDepthPrepass>),
        With<Camera3d>,
    >,
) {
    for (entity, camera, layers, has_prepass, is_ours) in &cameras {
        let layers = layers.cloned().unwrap_or_default();
        let sees = |of: Option<&RenderLayers>| of.cloned().unwrap_or_default().intersects(&layers);
        let needs_depth = camera.is_active && volumes.iter().any(sees);
        let mut entity = commands.entity(entity);
        if needs_depth && !has_prepass {
            // In this order: see `leave_to_user`.
            entity.try_insert(DepthPrepass).try_insert(AddedDepthPrepass);
        } else if is_ours && !needs_depth {
            entity.try_remove::<(DepthPrepass, AddedDepthPrepass)>();
        }
    }
}

/// Leaves a depth prepass to the user once the user inserts one over ours.
pub(super) fn leave_to_user(
    inserted: On<Insert, DepthPrepass>,
    ours: Query<(), With<AddedDepthPrepass>>,
    mut commands: Commands,
) {
    if ours.contains(inserted.entity) {
        commands.entity(inserted.entity).try_remove::<AddedDepthPrepass>();
    }
}
