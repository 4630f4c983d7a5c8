//! How a volume is shaded by ambient occlusion: the settings and the ray patterns (pure maths).

mod directions;
mod settings;

use bevy::prelude::*;

pub use directions::{RayDirection, RayPattern, fibonacci_direction};
pub use settings::{AmbientOcclusion, ShadingMode, VolumeShading};

/// Registers the shading components.
pub(crate) struct OcclusionPlugin;

impl Plugin for OcclusionPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<AmbientOcclusion>().register_type::<VolumeShading>();
    }
}
