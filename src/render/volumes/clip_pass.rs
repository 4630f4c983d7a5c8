//! Settings of the passes of step IV over a volume in a frame (`clip_pass.wgsl`).

use bevy::{math::UVec3, render::render_resource::ShaderType};

/// Stale voxels that clipping lists for casting without the request of a view, as `QUEUE_*` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Queue {
    #[default]
    None,
    Sampleable,
    Visible,
    All,
}

/// Settings of the passes of step IV, as `ClipPass` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct ClipPassUniform {
    pub first_superbrick: UVec3,
    pub clipping: u32,
    pub end_superbrick: UVec3,
    pub visits_all: u32,
    pub lists_all: u32,
    pub is_all_stale: u32,
    pub queue: u32,
    pub changes: u32,
    pub past_changes: u32,
    pub coverage: u32,
}
