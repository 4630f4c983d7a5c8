//! View rays, and the shading of what they meet, as passes and drawing share them.

use bevy::{prelude::*, shader::load_shader_library};

/// Makes the shaders known.
pub(super) fn add_shaders(app: &mut App) {
    load_shader_library!(app, "view_ray.wgsl");
    load_shader_library!(app, "orientation.wgsl");
    load_shader_library!(app, "shading.wgsl");
    load_shader_library!(app, "window.wgsl");
}
