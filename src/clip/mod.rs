//! Carvers: the [`ClipMesh`] component and the clip camera fixed to its mesh.

mod clip_camera;
mod clip_mesh;
mod clip_settings;
mod pose;
mod relative_pose;

use bevy::{asset::AssetEventSystems, prelude::*};

use crate::volume::VolumeSystems;

pub use clip_camera::{ClipCamera, ClipFrame, DilationFrame};
pub(crate) use clip_mesh::SpawnOrder;
pub use clip_mesh::{ClipMesh, ClipMeshCutOff, ClipMeshFailed, ClipOperation, ClipTargets, MAX_CARVERS};
pub(crate) use clip_settings::{ClipCapacity, LayersWanted, MAX_LAYERS};
pub use clip_settings::{ClipSettings, CoverageRule};
pub(crate) use relative_pose::{RelativePoses, placed};

/// Sets of the clip plugin's systems, in [`PostUpdate`].
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ClipSystems {
    /// Decides the room for depth and dilation maps.
    Capacity,
    /// Deforms skinned and morphing meshes.
    Pose,
    /// Makes clip cameras follow their meshes.
    Cameras,
}

/// Registers the clipping components and keeps every clip camera in step with its mesh.
pub(crate) struct ClipPlugin;

impl Plugin for ClipPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<ClipSettings>()
            .init_resource::<ClipCapacity>()
            .init_resource::<LayersWanted>()
            .add_observer(clip_mesh::warn_of_cut_off)
            .add_observer(clip_mesh::number_carvers)
            .add_systems(
                PostUpdate,
                (
                    // Fitting volumes needs the bytes that carvers take.
                    clip_settings::update_capacity.in_set(ClipSystems::Capacity).before(VolumeSystems::Fit),
                    (pose::pose_meshes, pose::remove_poses)
                        .in_set(ClipSystems::Pose)
                        .after(TransformSystems::Propagate)
                        .before(AssetEventSystems),
                    (clip_camera::update_clip_cameras, clip_camera::remove_clip_cameras)
                        .in_set(ClipSystems::Cameras)
                        .after(AssetEventSystems)
                        .after(pose::pose_meshes),
                ),
            );
    }
}
