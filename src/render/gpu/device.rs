//! Device resources for planning passes.

use bevy::{
    ecs::system::SystemParam,
    prelude::*,
    render::{
        render_resource::PipelineCache,
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::formats::Formats;

/// Present in both worlds if the device supports the passes.
#[derive(Resource)]
pub(crate) struct DeviceSupport;

/// The device, and the resources made with it.
#[derive(SystemParam)]
pub struct Gpu<'w> {
    /// Makes buffers, textures and bind groups.
    pub device: Res<'w, RenderDevice>,
    /// Writes data that shaders read.
    pub queue: Res<'w, RenderQueue>,
    /// Holds pipelines and layouts.
    pub cache: Res<'w, PipelineCache>,
    pub(crate) formats: Res<'w, Formats>,
}
