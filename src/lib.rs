//! Volumes (CT, MRI) in [Bevy](https://bevy.org), carved by hand and shaded with ambient occlusion.
//!
//! The occlusion is exactly equal to a full recomputation, in the same frame.
//!
//! Add [`ContextualAoPlugin`], spawn a [`VolumeBundle`] and a mesh with
//! [`ClipMesh`](clip::ClipMesh), and move the mesh:
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_contextual_ao::prelude::*;
//!
//! App::new()
//!     .add_plugins((DefaultPlugins, ContextualAoPlugin))
//!     .add_systems(Startup, |mut commands: Commands, assets: Res<AssetServer>, mut meshes: ResMut<Assets<Mesh>>| {
//!         // By default a camera sees nothing nearer than 0.1 m, and slices close objects open.
//!         let near = Projection::Perspective(PerspectiveProjection { near: 0.001, ..default() });
//!         let view = Transform::from_xyz(0.0, 0.0, 0.6).looking_at(Vec3::ZERO, Vec3::Y);
//!         commands.spawn((Camera3d::default(), near, view));
//!         commands.spawn(VolumeBundle::new(assets.load("head.nii.gz")));
//!         commands.spawn((ClipMesh::default(), Mesh3d(meshes.add(Sphere::new(0.05))), Transform::from_xyz(0.05, 0.05, 0.05)));
//!     })
//!     .run();
//! ```
//!
//! The method is *Contextual Ambient Occlusion* (Titov, Kersten-Oertel, Drouin: Computers & Graphics 2024,
//! doi:10.1016/j.cag.2024.01.011).
//!
//! Data flows one way through the modules. [`volume`], [`clip`] and [`occlusion`] describe the volumes, the carvers and
//! the shading. `picking` casts rays at them. `hands` holds them. `render` extracts these descriptions and runs the passes.
//! [`drawing`] draws the volumes. `gizmos` draws boxes around parts of this work. [`diagnostics`] reports the work done.

#![cfg_attr(
    not(all(
        feature = "gizmos",
        feature = "meta_image",
        feature = "nifti",
        feature = "nrrd",
        feature = "other_methods",
        feature = "slicer"
    )),
    allow(dead_code, unused_variables, reason = "what parts share is not all used where some are left out")
)]

mod bundle;
pub mod clip;
pub mod diagnostics;
pub mod drawing;
#[cfg(feature = "gizmos")]
pub mod gizmos;
#[cfg(feature = "hands")]
pub mod hands;
pub mod occlusion;
#[cfg(feature = "picking")]
pub mod picking;
mod plugin;
pub mod render;
pub mod volume;

pub use bundle::VolumeBundle;
pub use plugin::ContextualAoPlugin;

/// Items that most apps need.
pub mod prelude {
    #[cfg(feature = "gizmos")]
    pub use crate::gizmos::{ListedBricks, ShowVolumeGizmos, VolumeGizmoConfigGroup};
    #[cfg(feature = "hands")]
    pub use crate::hands::{
        CarveWhile, ChangeShape, Grabbable, Grabbed, Hand, HandSystems, HeldBy, HeldCarver, Holds, Released,
        ToggleOperation,
    };
    #[cfg(feature = "other_methods")]
    pub use crate::occlusion::{
        DirectionalOcclusion, OcclusionFiltering, OcclusionSweeping, ScreenSpaceOcclusion,
        SummedAreaOcclusion,
    };
    #[cfg(feature = "picking")]
    pub use crate::picking::{
        VolumeHit, VolumePickingCamera, VolumePickingSettings, VolumeRayCast, VolumeRayCastSettings,
    };
    pub use crate::{
        ContextualAoPlugin, VolumeBundle,
        clip::{
            ClipMesh, ClipMeshCutOff, ClipMeshFailed, ClipOperation, ClipSettings, ClipTargets, CoverageRule,
        },
        occlusion::{
            AmbientOcclusion, AmbientScale, CastBudget, CastPacing, MotionQuality, OcclusionFailed,
            OcclusionMethod, OcclusionRays, OcclusionResolution, ProgressiveRays, Quality, RayPattern,
            Recompute, Reconstruction, Sky, VolumeDepth, VolumeLighting, VolumeShading, VoxelOpacities,
        },
        volume::{
            ControlPoint, GradientPoint, GradientUnit, OcclusionReady, PointsAtGradient, Preset,
            TransferFunction, Volume, Volume3d, VolumeBudget, VolumeFailed, VolumeFailure, VolumeLoaded,
            VolumeOccluded, VolumeTransferFunction,
        },
    };
}
