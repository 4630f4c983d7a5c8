//! What cuts a volume: the [`ClipMesh`] component and the clip camera fixed to its mesh.

mod clip_camera;
mod clip_mesh;

use bevy::prelude::*;

pub use clip_camera::{ClipCamera, ClipFrame, DilationFrame};
pub(crate) use clip_mesh::ClipCapacity;
pub use clip_mesh::{ClipMesh, ClipMeshFailed, ClipOperation, ClipSettings, ClipTargets, MAX_CARVERS};

/// Registers the clipping components and keeps every clip camera in step with its mesh.
pub(crate) struct ClipPlugin;

impl Plugin for ClipPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<ClipSettings>().init_resource::<ClipCapacity>().add_systems(
            PostUpdate,
            (clip_camera::update_clip_cameras, clip_camera::remove_clip_cameras)
                .after(bevy::asset::AssetEventSystems),
        );
    }
}
