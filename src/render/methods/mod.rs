//! Step V of the CAO paper: the occlusion, by rays as the paper has it, or by another method.

pub(super) mod direct;
pub(super) mod filtering;
pub(super) mod fit_occlusion;
pub(super) mod method_bytes;
pub(super) mod rays;
pub(super) mod screen_space;
pub(super) mod sweeping;

use bevy::prelude::*;

/// Makes the shaders known.
pub(super) fn add_shaders(app: &mut App) {
    rays::add_shaders(app);
    filtering::add_shaders(app);
    sweeping::add_shaders(app);
}
