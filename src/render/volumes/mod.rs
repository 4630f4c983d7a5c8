//! What stays on the device of a volume, and how passes bind it.

pub(super) mod brick_resources;
pub(super) mod carver_uniform;
pub(super) mod gpu_volume;
pub(super) mod occlusion_texels;
pub(super) mod pass_uniforms;
pub(crate) mod volume_bindings;
pub(super) mod volume_state;
pub(super) mod volume_store;
pub(super) mod volume_uniform;

use bevy::{prelude::*, shader::load_shader_library};

/// Makes the shaders known.
pub(super) fn add_shaders(app: &mut App) {
    load_shader_library!(app, "volume_bindings.wgsl");
    load_shader_library!(app, "bricks.wgsl");
    load_shader_library!(app, "brick_bindings.wgsl");
    load_shader_library!(app, "voxel_masks.wgsl");
    load_shader_library!(app, "work_list.wgsl");
    load_shader_library!(app, "listed.wgsl");
    load_shader_library!(app, "changes.wgsl");
    load_shader_library!(app, "occlusion_pass.wgsl");
}
