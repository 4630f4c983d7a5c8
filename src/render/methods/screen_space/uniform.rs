//! Uniforms of the passes over a view.

use bevy::{
    prelude::*,
    render::render_resource::{ShaderType, TextureFormat},
};

use crate::occlusion::ScreenSpaceOcclusion;

/// Format of textures of surfaces: depth and normal.
pub(super) const SURFACE_FORMAT: TextureFormat = TextureFormat::Rg32Uint;

/// A view, as `ScreenSpaceView` in WGSL.
#[derive(Clone, Copy, Default, PartialEq, ShaderType)]
pub(in crate::render) struct ScreenSpaceUniform {
    pub clip_from_view: Mat4,
    pub view_from_clip: Mat4,
    pub viewport: Vec4,
    pub radius: f32,
    pub bias: f32,
}

/// Kernel of points around each pixel's point, `Kernel` in WGSL.
#[derive(Clone, Copy, PartialEq, ShaderType)]
pub(in crate::render) struct KernelUniform {
    pub points: [Vec4; 256],
    pub samples: u32,
}

impl Default for KernelUniform {
    fn default() -> Self {
        Self { points: [Vec4::ZERO; 256], samples: 0 }
    }
}

impl KernelUniform {
    pub fn of(settings: &ScreenSpaceOcclusion) -> Self {
        let kernel = settings.kernel();
        let point = |k: usize| kernel.get(k).map_or(Vec4::ZERO, |point| point.extend(0.0));
        Self { points: core::array::from_fn(point), samples: kernel.len() as u32 }
    }
}
