//! What planning a pass takes of the device.

use bevy::{
    ecs::system::SystemParam,
    prelude::*,
    render::{
        render_resource::PipelineCache,
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::formats::Formats;

/// Stands in both worlds where the device has what the passes need.
#[derive(Resource)]
pub(crate) struct DeviceSupport;

/// The device, and what is made with it.
#[derive(SystemParam)]
pub struct Gpu<'w> {
    /// Makes buffers, textures and bind groups.
    pub device: Res<'w, RenderDevice>,
    /// Writes what shaders read.
    pub queue: Res<'w, RenderQueue>,
    /// Has pipelines and layouts.
    pub cache: Res<'w, PipelineCache>,
    pub(crate) formats: Res<'w, Formats>,
}
