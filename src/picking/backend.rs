//! Tells Bevy's picking which volumes pointers hit.

use bevy::{
    camera::visibility::RenderLayers,
    picking::backend::{HitData, PointerHits, ray::RayMap},
    prelude::*,
};

use super::{VolumePickingCamera, VolumePickingSettings, VolumeRayCast, VolumeRayCastSettings};

/// Casts the rays of all pointers in 3D cameras. A hit counts for the volume's own entity.
pub(super) fn hit_volumes(
    settings: Res<VolumePickingSettings>,
    rays: Res<RayMap>,
    cameras: Query<(&Camera, Has<VolumePickingCamera>, Option<&RenderLayers>), With<Camera3d>>,
    pickables: Query<&Pickable>,
    ray_cast: VolumeRayCast,
    mut hits: MessageWriter<PointerHits>,
) {
    for (&id, &ray) in rays.iter() {
        let Ok((camera, is_marked, layers)) = cameras.get(id.camera) else {
            continue;
        };
        if settings.require_markers && !is_marked {
            continue;
        }
        let may_be_hit = |volume: Entity| {
            pickables.get(volume).map_or(!settings.require_markers, |pickable| *pickable != Pickable::IGNORE)
        };
        let cast = VolumeRayCastSettings::default()
            .with_stopped_light(settings.stopped_light)
            .with_layers(layers.cloned().unwrap_or_default())
            .with_filter(&may_be_hit);
        let picks: Vec<_> = ray_cast
            .cast_all(ray, &cast)
            .into_iter()
            .map(|hit| {
                let (position, normal) = (Some(hit.position), Some(*hit.normal));
                (hit.volume, HitData::new_with_extra(id.camera, hit.distance, position, normal, hit))
            })
            .collect();
        if !picks.is_empty() {
            hits.write(PointerHits::new(id.pointer, picks, camera.order as f32));
        }
    }
}
