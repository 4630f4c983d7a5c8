//! GPU resources of a volume that stay, and their bindings.

pub(super) mod bindings;
mod blue_noise;
pub(super) mod bricks;
pub(super) mod carver_uniform;
pub(super) mod clip_pass;
pub(super) mod contents;
pub(super) mod gpu_table;
pub(super) mod intensities;
pub(super) mod kept;
pub(crate) mod layouts;
pub(super) mod listed_cast;
mod preintegration;
pub(super) mod store;
pub(super) mod uniform;

use bevy::{prelude::*, shader::load_shader_library};

/// Adds the shader libraries.
pub(super) fn add_shaders(app: &mut App) {
    load_shader_library!(app, "bindings.wgsl");
    load_shader_library!(app, "reconstruction.wgsl");
    load_shader_library!(app, "gradients.wgsl");
    load_shader_library!(app, "classification.wgsl");
    load_shader_library!(app, "preintegration.wgsl");
    load_shader_library!(app, "bricks.wgsl");
    load_shader_library!(app, "brick_bindings.wgsl");
    load_shader_library!(app, "superbricks.wgsl");
    load_shader_library!(app, "voxel_masks.wgsl");
    load_shader_library!(app, "work_list.wgsl");
    load_shader_library!(app, "listed.wgsl");
    load_shader_library!(app, "clip_pass.wgsl");
}
