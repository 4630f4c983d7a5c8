//! The data that single passes read: what a frame does to a volume, and the views that look at it.

use bevy::{prelude::*, render::render_resource::ShaderType};

/// Which stale voxels are cast without being asked for by a view, as `QUEUE_*` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Queue {
    #[default]
    None,
    Sampleable,
    Visible,
    All,
}

/// What a frame does to a volume, as `OcclusionPass` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct OcclusionPassUniform {
    pub lists_all: u32,
    pub is_all_stale: u32,
    pub queue: u32,
    pub changes: u32,
    pub past_changes: u32,
    pub coverage: u32,
    pub first_ray: u32,
    pub end_ray: u32,
    pub steps: u32,
    pub ends_early: u32,
    pub leaps: u32,
    pub kept: f32,
    pub found_weight: f32,
}

/// A view of a volume, as `Window` in WGSL (`window.wgsl`).
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct WindowUniform {
    pub view_from_clip: Mat4,
    pub world_from_view: Mat4,
    /// Origin and size, pixels.
    pub viewport: Vec4,
    /// Pixels in which the volume may be seen.
    pub first: UVec2,
    pub end: UVec2,
}
