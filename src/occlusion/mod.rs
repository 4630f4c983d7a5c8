//! Ambient occlusion of volumes: the methods and their settings, and the ray patterns (pure maths).

mod cast_budget;
mod cast_pacing;
mod custom;
#[cfg(feature = "other_methods")]
mod directional;
mod directions;
#[cfg(feature = "other_methods")]
mod filtering;
mod fit;
mod flat_surface;
mod frame_control;
mod lengths;
mod method;
mod method_settings;
mod motion;
mod motion_quality;
mod octants;
mod optimizations;
mod progressive;
mod quality;
mod rays;
#[cfg(feature = "other_methods")]
mod screen_space;
mod settings;
mod shading;
mod shortfall;
mod sky;
mod step_control;
mod stereo;
#[cfg(feature = "other_methods")]
mod summed_area;
#[cfg(feature = "other_methods")]
mod sweeping;
mod texels;
#[cfg(feature = "other_methods")]
mod turned_grid;
mod volume_depth;

use bevy::{
    camera::{CameraUpdateSystems, visibility::VisibilitySystems},
    ecs::component::RequiredComponentsError,
    prelude::*,
};

pub use cast_budget::CastBudget;
pub use cast_pacing::CastPacing;
pub(crate) use cast_pacing::PacedWords;
pub use custom::CustomMethod;
#[cfg(feature = "other_methods")]
pub use directional::DirectionalOcclusion;
pub use directions::{RayDirection, RayPattern, fibonacci_direction};
#[cfg(feature = "other_methods")]
pub use filtering::{DensityEstimate, DensitySource, OcclusionFiltering, OpacityModulation};
pub(crate) use fit::{FittedOcclusion, ShownOcclusion, fit_occlusion};
pub use method::OcclusionMethod;
pub use method_settings::{MethodBytes, MethodDrawing, MethodKind, MethodSettings};
pub use motion_quality::MotionQuality;
pub(crate) use motion_quality::MotionSampling;
pub use optimizations::Optimizations;
pub use progressive::ProgressiveRays;
pub use quality::Quality;
pub use rays::{OcclusionRays, OcclusionResolution};
#[cfg(feature = "other_methods")]
pub use screen_space::{ScreenSpaceBlur, ScreenSpaceOcclusion};
pub use settings::{AmbientOcclusion, Recompute, VoxelOpacities};
pub use shading::{AmbientScale, Reconstruction, VolumeLighting, VolumeShading};
pub use shortfall::{OcclusionFailed, OcclusionFallback, OcclusionLimit, OcclusionShortfall};
pub use sky::Sky;
pub use stereo::OcclusionDiffersBetweenEyes;
#[cfg(feature = "other_methods")]
pub use summed_area::SummedAreaOcclusion;
#[cfg(feature = "other_methods")]
pub use sweeping::{GeometryTerm, OcclusionSweeping, SweepDistancesAlone, SweepingSurface};
pub use texels::OcclusionTexels;
#[cfg(feature = "other_methods")]
pub(crate) use turned_grid::TurnedGrid;
pub use volume_depth::VolumeDepth;

use crate::{clip::ClipSystems, volume::Volume3d};

/// Registers the shading components.
pub(crate) struct OcclusionPlugin;

impl Plugin for OcclusionPlugin {
    fn build(&self, app: &mut App) {
        require::<AmbientOcclusion>(app);
        require::<VolumeShading>(app);
        #[cfg(feature = "other_methods")]
        app.init_resource::<SweepDistancesAlone>();
        app.init_resource::<Optimizations>()
            .init_resource::<CastBudget>()
            .add_observer(shortfall::warn_of_shortfall)
            .add_observer(stereo::warn_of_eyes)
            .add_systems(PostUpdate, stereo::find_eyes.after(VisibilitySystems::CheckVisibility))
            .register_type::<Optimizations>()
            .register_type::<CastBudget>()
            .register_type::<CastPacing>()
            .register_type::<AmbientOcclusion>()
            .register_type::<VolumeShading>()
            .register_type::<VolumeDepth>()
            .register_type::<MotionQuality>()
            .add_systems(
                PostUpdate,
                motion::follow_motion
                    .after(TransformSystems::Propagate)
                    .after(CameraUpdateSystems)
                    .after(ClipSystems::Cameras)
                    .run_if(any_with_component::<MotionQuality>.and_then(resource_exists::<Time<Real>>)),
            );
    }
}

/// Gives every volume a component with its defaults.
fn require<C: Component + Default>(app: &mut App) {
    if let Err(RequiredComponentsError::ArchetypeExists(_)) =
        app.try_register_required_components::<Volume3d, C>()
    {
        error!("volumes spawned before ContextualAoPlugin was added have no {}", ShortName::of::<C>());
    }
}
