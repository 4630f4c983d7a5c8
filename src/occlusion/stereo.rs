//! A warning where the two eyes of a viewer see occlusion that belongs to a view.

use bevy::{
    camera::{RenderTarget, visibility::VisibleEntities},
    ecs::entity::EntityHashSet,
    prelude::*,
    render::texture::{ManualTextureView, ManualTextureViews},
};
use core::any::TypeId;

use super::{AmbientOcclusion, OcclusionMethod, VolumeShading};
use crate::volume::{DrawnBox, VolumeBox};

/// Event on a volume whose occlusion differs between the eyes that see it. It is triggered once for a volume.
///
/// Two cameras are eyes of one viewer if they draw into different
/// [`ManualTextureViews`](bevy::render::texture::ManualTextureViews) of one texture with layers, as XR crates let them.
/// Cameras that share a window or an image are not.
#[derive(EntityEvent, Clone, Copy, Debug, PartialEq, Eq)]
pub struct OcclusionDiffersBetweenEyes {
    /// The volume's entity.
    pub entity: Entity,
    /// Name of its method, which computes the occlusion of each view.
    pub method: &'static str,
}

/// Finds volumes that both eyes of a viewer see, by a method of views.
pub(super) fn find_eyes(
    mut commands: Commands,
    cameras: Query<(&Camera, &RenderTarget, &VisibleEntities)>,
    views: Option<Res<ManualTextureViews>>,
    volumes: Query<(Entity, &AmbientOcclusion, &VolumeShading, &VolumeBox)>,
    mut told: Local<EntityHashSet>,
) {
    let Some(views) = views else {
        return;
    };
    told.retain(|volume| volumes.contains(*volume));
    for (entity, AmbientOcclusion { method, .. }, shading, VolumeBox(drawn_on)) in &volumes {
        if method.kind().is_of_voxels() || !shading.ambient_occlusion || told.contains(&entity) {
            continue;
        }
        let seeing = cameras.iter().filter(|(camera, _, visible)| {
            camera.is_active && visible.get(TypeId::of::<DrawnBox>()).contains(drawn_on)
        });
        let mut targets: Vec<_> = seeing
            .filter_map(|(_, target, _)| match target {
                RenderTarget::TextureView(handle) => Some(*handle),
                _ => None,
            })
            .collect();
        targets.sort_unstable();
        targets.dedup();
        let targets: Vec<_> = targets.iter().filter_map(|handle| views.get(handle)).collect();
        let are_eyes = |(index, view): (usize, &&ManualTextureView)| {
            targets[index + 1..].iter().any(|other| are_layers(view, other))
        };
        if targets.iter().enumerate().any(are_eyes) {
            told.insert(entity);
            commands.trigger(OcclusionDiffersBetweenEyes { entity, method: method.name() });
        }
    }
}

/// Whether two views are layers of one texture.
fn are_layers(a: &ManualTextureView, b: &ManualTextureView) -> bool {
    let [a, b] = [a, b].map(|view| view.texture_view.texture());
    a == b && a.depth_or_array_layers() > 1
}

/// Logs that occlusion differs, with the methods that are alike in both eyes.
pub(super) fn warn_of_eyes(differs: On<OcclusionDiffersBetweenEyes>) {
    let alike = OcclusionMethod::all().into_iter().filter(|method| method.kind().is_of_voxels());
    let alike: Vec<_> = alike.map(|method| method.name()).collect();
    warn!(
        "the volume on {}: occlusion by `{}` differs between the two eyes that see it; alike in both are {}",
        differs.entity,
        differs.method,
        alike.join(", ")
    );
}
