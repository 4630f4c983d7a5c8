//! How a volume is shaded by ambient occlusion: the methods and their settings, and the ray patterns (pure
//! maths).

mod direct;
mod directions;
mod filtering;
mod method;
mod progressive;
mod screen_space;
mod settings;
mod shortcuts;
mod shortfall;
mod sky;
mod sweeping;

use bevy::prelude::*;

pub use direct::DirectOcclusion;
pub use directions::{RayDirection, RayPattern, fibonacci_direction};
pub use filtering::{DensityEstimate, DensitySource, OcclusionFiltering, OpacityModulation};
pub use method::OcclusionMethod;
pub use progressive::ProgressiveRays;
pub use screen_space::ScreenSpaceOcclusion;
pub use settings::{AmbientOcclusion, OcclusionResolution, ShadingMode, VolumeShading};
pub use shortcuts::Shortcuts;
pub(crate) use shortfall::{FittedOcclusion, ShownOcclusion};
pub use shortfall::{OcclusionFailed, OcclusionFallback, OcclusionLimit, OcclusionShortfall};
pub use sky::Sky;
pub use sweeping::{GeometryTerm, OcclusionSweeping, SweepingSurface};

/// Registers the shading components.
pub(crate) struct OcclusionPlugin;

impl Plugin for OcclusionPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Shortcuts>()
            .add_observer(shortfall::warn_of_shortfall)
            .register_type::<Shortcuts>()
            .register_type::<AmbientOcclusion>()
            .register_type::<VolumeShading>();
    }
}
