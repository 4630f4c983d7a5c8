//! How a volume is shaded by ambient occlusion: the settings and the ray patterns (pure maths).

mod directions;
mod settings;
mod shortcuts;

use bevy::prelude::*;

pub use directions::{RayDirection, RayPattern, fibonacci_direction};
pub use settings::{AmbientOcclusion, ShadingMode, VolumeShading};
pub use shortcuts::Shortcuts;

/// Registers the shading components.
pub(crate) struct OcclusionPlugin;

impl Plugin for OcclusionPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Shortcuts>()
            .register_type::<Shortcuts>()
            .register_type::<AmbientOcclusion>()
            .register_type::<VolumeShading>();
    }
}
