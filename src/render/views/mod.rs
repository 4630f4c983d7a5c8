//! Shaders that passes and drawing share: view rays, and the shading of their samples.

use bevy::{prelude::*, shader::load_shader_library};

/// Adds the shader libraries.
pub(super) fn add_shaders(app: &mut App) {
    load_shader_library!(app, "view_ray.wgsl");
    load_shader_library!(app, "orientation.wgsl");
    load_shader_library!(app, "shading.wgsl");
    load_shader_library!(app, "window.wgsl");
}
