//! Local ambient occlusion by rays around voxels, cast where it is stale and seen.

pub(in crate::render) mod mark;
pub(in crate::render) mod ray_cast;

use bevy::{asset::embedded_asset, prelude::*};

/// Makes the shaders known.
pub(super) fn add_shaders(app: &mut App) {
    embedded_asset!(app, "mark.wgsl");
    embedded_asset!(app, "ray_cast.wgsl");
}
