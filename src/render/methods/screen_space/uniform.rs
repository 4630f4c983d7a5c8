//! What the passes over a view read of it.

use bevy::{
    prelude::*,
    render::render_resource::{ShaderType, TextureFormat},
};

/// Of textures of surfaces: depth and normal.
pub(super) const SURFACE_FORMAT: TextureFormat = TextureFormat::Rg32Uint;

/// A view, as `ScreenSpaceView` in WGSL.
#[derive(Clone, Copy, ShaderType)]
pub(in crate::render) struct ScreenSpaceUniform {
    pub clip_from_view: Mat4,
    pub view_from_clip: Mat4,
    pub viewport: Vec4,
    pub radius: f32,
    pub bias: f32,
}
