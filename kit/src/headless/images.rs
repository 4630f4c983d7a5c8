//! Images to render into, and what is read back from the GPU.

use bevy::{
    asset::RenderAssetUsages,
    prelude::*,
    render::{
        render_resource::{
            Buffer, BufferDescriptor, BufferUsages, CommandEncoder, CommandEncoderDescriptor, MapMode,
            PollType, TexelCopyBufferInfo, TexelCopyBufferLayout, Texture, TextureFormat, TextureUsages,
        },
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::Headless;

impl Headless {
    /// Bytes of a texture, with packed rows, layer after layer.
    pub fn bytes_of(&self, texture: &Texture) -> Vec<u8> {
        read_texture(self.render_world(), texture)
    }
}

/// Adds an image to render into.
pub(super) fn add_target(app: &mut App, size: UVec2, format: TextureFormat) -> Handle<Image> {
    let mut image = Image::new_target_texture(size.x, size.y, format, None);
    image.asset_usage = RenderAssetUsages::RENDER_WORLD;
    image.texture_descriptor.usage |= TextureUsages::COPY_SRC;
    app.world_mut().resource_mut::<Assets<Image>>().add(image)
}

/// Copies a texture to the CPU with packed rows.
pub(super) fn read_texture(render_world: &World, texture: &Texture) -> Vec<u8> {
    let size = texture.size();
    let row = size.width as usize * texture.format().block_copy_size(None).unwrap_or(1) as usize;
    let padded = RenderDevice::align_copy_bytes_per_row(row);
    let rows = size.height as usize * size.depth_or_array_layers as usize;
    let bytes = read_back(render_world, (padded * rows) as u64, |encoder, buffer| {
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            TexelCopyBufferInfo {
                buffer,
                layout: TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(padded as u32),
                    rows_per_image: Some(size.height),
                },
            },
            size,
        );
    });
    bytes.chunks(padded).flat_map(|line| &line[..row]).copied().collect()
}

/// Reads back `size` bytes that `copy` puts into a buffer.
pub(super) fn read_back(
    render_world: &World,
    size: u64,
    copy: impl FnOnce(&mut CommandEncoder, &Buffer),
) -> Vec<u8> {
    let device = render_world.resource::<RenderDevice>();
    let queue = render_world.resource::<RenderQueue>();
    let buffer = device.create_buffer(&BufferDescriptor {
        label: Some("read back"),
        size,
        usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
    copy(&mut encoder, &buffer);
    queue.submit([encoder.finish()]);
    let slice = buffer.slice(..);
    device.map_buffer(&slice, MapMode::Read, |_| {});
    let _ = device.poll(PollType::wait_indefinitely());
    slice.get_mapped_range().to_vec()
}
