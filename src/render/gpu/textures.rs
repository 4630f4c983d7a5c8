//! Textures with their views, and GPU usage of textures and buffers.

use bevy::{
    prelude::*,
    render::{
        render_resource::{
            Buffer, Extent3d, Texture, TextureDescriptor, TextureDimension, TextureFormat, TextureUsages,
            TextureView, TextureViewDescriptor, TextureViewDimension,
        },
        renderer::RenderDevice,
    },
};

use crate::diagnostics::GpuUsage;

/// A texture with a view of the whole texture.
#[derive(Clone)]
pub(crate) struct TextureAndView {
    pub texture: Texture,
    pub view: TextureView,
}

impl TextureAndView {
    pub fn new(
        device: &RenderDevice,
        descriptor: &TextureDescriptor,
        dimension: TextureViewDimension,
    ) -> Self {
        let texture = device.create_texture(descriptor);
        let view = texture.create_view(&TextureViewDescriptor { dimension: Some(dimension), ..default() });
        Self { texture, view }
    }

    /// Makes a square 2D array texture that shaders read.
    pub fn array(
        device: &RenderDevice,
        label: &'static str,
        (size, layers): (u32, u32),
        format: TextureFormat,
        written_as: TextureUsages,
    ) -> Self {
        let descriptor = square(label, (size, layers), format, written_as);
        Self::new(device, &descriptor, TextureViewDimension::D2Array)
    }

    /// Makes a square 2D texture that shaders read.
    pub fn single(
        device: &RenderDevice,
        label: &'static str,
        size: u32,
        format: TextureFormat,
        written_as: TextureUsages,
    ) -> Self {
        let descriptor = square(label, (size, 1), format, written_as);
        Self::new(device, &descriptor, TextureViewDimension::D2)
    }
}

/// Describes square textures that shaders read. `written_as` is the usage for writing.
fn square(
    label: &'static str,
    (size, layers): (u32, u32),
    format: TextureFormat,
    written_as: TextureUsages,
) -> TextureDescriptor<'static> {
    TextureDescriptor {
        label: Some(label),
        size: Extent3d { width: size, height: size, depth_or_array_layers: layers },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage: written_as | TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    }
}

/// Bytes of the largest buffer that shaders of a device can bind whole.
pub(crate) fn largest_storage_buffer(device: &RenderDevice) -> u64 {
    let limits = device.limits();
    limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
}

/// Number and bytes of some buffers.
pub(crate) fn usage_of_buffers<'a>(buffers: impl IntoIterator<Item = &'a Buffer>) -> GpuUsage {
    buffers.into_iter().fold(default(), |sum: GpuUsage, buffer| {
        sum + GpuUsage { buffers: 1, bytes: buffer.size(), ..default() }
    })
}

/// Number and bytes of some textures.
pub(crate) fn usage_of<'a>(textures: impl IntoIterator<Item = &'a Texture>) -> GpuUsage {
    let mut usage = GpuUsage::default();
    for texture in textures {
        let size = texture.size();
        let texels = size.width as u64 * size.height as u64 * size.depth_or_array_layers as u64;
        usage.textures += 1;
        usage.bytes += texels * texture.format().block_copy_size(None).unwrap_or(4) as u64;
    }
    usage
}
