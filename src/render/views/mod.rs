//! View rays: what they meet (`march`), and shaders that shade it.

pub(super) mod dispatch;
pub(super) mod march;
pub(super) mod outline_lists;
mod outlines;
pub(super) mod runs;

use bevy::{asset::embedded_asset, prelude::*, shader::load_shader_library};

/// Adds the shaders.
pub(super) fn add_shaders(app: &mut App) {
    load_shader_library!(app, "window.wgsl");
    load_shader_library!(app, "marched_view.wgsl");
    load_shader_library!(app, "view_ray.wgsl");
    load_shader_library!(app, "runs.wgsl");
    load_shader_library!(app, "lit_slices.wgsl");
    load_shader_library!(app, "next_run.wgsl");
    load_shader_library!(app, "stop.wgsl");
    load_shader_library!(app, "seen.wgsl");
    load_shader_library!(app, "cut_surface.wgsl");
    load_shader_library!(app, "orientation.wgsl");
    load_shader_library!(app, "shading.wgsl");
    embedded_asset!(app, "march.wgsl");
    embedded_asset!(app, "outlines.wgsl");
}
