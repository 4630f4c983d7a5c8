//! Finds out whether anything moves that a volume's picture depends on.

use bevy::{
    camera::visibility::RenderLayers, ecs::system::SystemParam, platform::hash::FixedHasher, prelude::*,
};
use core::hash::{BuildHasher, Hash};

use super::{MotionQuality, MotionSampling, VolumeShading};
use crate::clip::{ClipCamera, ClipMesh, RelativePoses};

/// Everything whose place counts.
#[derive(SystemParam)]
pub(super) struct Places<'w, 's> {
    cameras: Query<'w, 's, (Entity, &'static Camera, Option<&'static RenderLayers>), With<Camera3d>>,
    carvers: Query<'w, 's, (Entity, &'static ClipMesh, &'static ClipCamera)>,
    poses: RelativePoses<'w, 's>,
}

impl Places<'_, '_> {
    /// Fingerprint of the places, relative to a volume, of the cameras that may show it and the carvers that act on it.
    /// The order in which they are found does not count.
    fn fingerprint(&self, volume: Entity, layers: &RenderLayers) -> u64 {
        let default_layers = RenderLayers::default();
        let sees = |of: Option<&RenderLayers>| of.unwrap_or(&default_layers).intersects(layers);
        let cameras =
            self.cameras.iter().filter(|(_, camera, layers)| camera.is_active && sees(*layers)).map(
                |(entity, camera, _)| {
                    let projection = camera.clip_from_view().to_cols_array().map(f32::to_bits);
                    hash((entity, self.pose(volume, entity), projection))
                },
            );
        let carvers = self
            .carvers
            .iter()
            .filter(|(_, clip_mesh, _)| clip_mesh.carves(volume))
            .map(|(entity, _, camera)| hash((entity, self.pose(volume, entity), camera.revision)));
        cameras.chain(carvers).fold(0, u64::wrapping_add)
    }

    /// Bits of the transform from a volume to an entity; `None` if either is collapsed.
    fn pose(&self, volume: Entity, entity: Entity) -> Option<[u64; 12]> {
        Some(self.poses.between(volume, entity)?.to_cols_array().map(f64::to_bits))
    }
}

fn hash(of: impl Hash) -> u64 {
    FixedHasher.hash_one(of)
}

/// Follows the motion and the frame time, for the volumes that adapt to it.
pub(super) fn follow_motion(
    mut volumes: Query<(Entity, &MotionQuality, &VolumeShading, Option<&RenderLayers>, &mut MotionSampling)>,
    places: Places,
    time: Res<Time<Real>>,
) {
    let default_layers = RenderLayers::default();
    for (entity, quality, shading, layers, mut sampling) in &mut volumes {
        let fingerprint = places.fingerprint(entity, layers.unwrap_or(&default_layers));
        sampling.follow(fingerprint, quality, shading.drawn_step_voxels(), time.delta_secs());
    }
}
