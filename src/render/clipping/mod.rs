//! Step IV of the CAO paper: the voxels that carvers touch, their coverage, and the bricks that are left empty.

pub(super) mod changes;
pub(super) mod clip;
pub(super) mod cull_bricks;
pub(super) mod cull_superbricks;
pub(super) mod distances;
pub(super) mod job;
pub(super) mod passes;
pub(super) mod ranges;
pub(super) mod static_distances;
pub(super) mod step;

use bevy::{asset::embedded_asset, prelude::*, shader::load_shader_library};

/// Adds the shaders.
pub(super) fn add_shaders(app: &mut App) {
    load_shader_library!(app, "changes.wgsl");
    load_shader_library!(app, "emptiness.wgsl");
    load_shader_library!(app, "clip_test.wgsl");
    load_shader_library!(app, "coverage.wgsl");
    load_shader_library!(app, "density.wgsl");
    embedded_asset!(app, "ranges.wgsl");
    embedded_asset!(app, "static_distances.wgsl");
    embedded_asset!(app, "cull_superbricks.wgsl");
    embedded_asset!(app, "cull_bricks.wgsl");
    embedded_asset!(app, "clip.wgsl");
    embedded_asset!(app, "expire.wgsl");
    embedded_asset!(app, "distances.wgsl");
}
