//! The intensities of a volume as a texture.

use bevy::{
    prelude::*,
    render::{
        render_resource::{Texture, TextureDataOrder, TextureUsages, TextureView},
        renderer::{RenderDevice, RenderQueue},
    },
};
use std::sync::Arc;

use crate::{
    render::gpu::formats::{Formats, volume_texture},
    volume::{Intensities, Volume},
};

/// A [`Volume`]'s intensities on the GPU, shared by all entities that show them.
pub(crate) struct GpuVolume {
    pub texture: Texture,
    pub view: TextureView,
    /// The stored intensity that the texture gives as 1.
    pub largest_stored: f64,
    intensities: Arc<Intensities>,
    dimensions: UVec3,
}

impl GpuVolume {
    pub fn new(volume: &Volume, formats: &Formats, device: &RenderDevice, queue: &RenderQueue) -> Self {
        let (format, bytes, largest_stored) = formats.encode_intensities(volume.intensities());
        let dimensions = volume.dimensions();
        let texture = device.create_texture_with_data(
            queue,
            &volume_texture("contextual_ao_intensities", dimensions, format, TextureUsages::COPY_DST),
            TextureDataOrder::default(),
            &bytes,
        );
        let view = texture.create_view(&default());
        let intensities = volume.shared_intensities().clone();
        Self { view, texture, largest_stored, intensities, dimensions }
    }

    /// Whether the texture holds the voxels of a volume.
    pub fn holds(&self, volume: &Volume) -> bool {
        Arc::ptr_eq(&self.intensities, volume.shared_intensities()) && self.dimensions == volume.dimensions()
    }
}
