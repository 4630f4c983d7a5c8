//! The data that the passes of step IV read (`clip_pass.wgsl`): what a frame does to a volume.

use bevy::render::render_resource::ShaderType;

/// Which stale voxels clipping lists for casting, without a view asking for them; as `QUEUE_*` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Queue {
    #[default]
    None,
    Sampleable,
    Visible,
    All,
}

/// What a frame does to a volume, as `ClipPass` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct ClipPassUniform {
    pub lists_all: u32,
    pub is_all_stale: u32,
    pub queue: u32,
    pub changes: u32,
    pub past_changes: u32,
    pub coverage: u32,
}
