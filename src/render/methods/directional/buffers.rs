//! Buffers that accumulate the slices of a view. Views, and volumes in a view, use them one after the other.

use bevy::{
    prelude::*,
    render::{
        render_resource::{
            Buffer, BufferDescriptor, BufferInitDescriptor, BufferUsages, Extent3d, TextureDescriptor,
            TextureDimension, TextureFormat, TextureUsages, TextureViewDimension,
        },
        renderer::RenderDevice,
    },
};

use crate::{
    diagnostics::GpuUsage,
    occlusion::DirectionalOcclusion,
    render::gpu::textures::{TextureAndView, largest_storage_buffer, usage_of, usage_of_buffers},
};

/// Format of the light textures, which all devices write and filter.
pub(super) const LIGHT_FORMAT: TextureFormat = TextureFormat::Rgba16Float;
/// Bytes between the numbers of successive slices, an offset that any device can bind.
pub(super) const NUMBER_STRIDE: u32 = 256;
/// Sizes of buffers are multiples of this, pixels, so that small changes of a window mostly keep them.
const GRAIN: u32 = 64;

/// Pixels along each side of a tile, `TILE` in WGSL.
pub(in crate::render) const TILE: u32 = 8;

/// Numbers of tiles of a window of this size (pixels), with a ring of background around it.
pub(super) fn tile_counts(window: UVec2) -> UVec2 {
    (window + 2).map(|pixels| pixels.div_ceil(TILE))
}

/// The buffers, while any view needs them.
#[derive(Resource, Default)]
pub(super) struct DirectionalBuffers(pub Option<Buffers>);

/// Buffers large enough for the largest window.
pub(super) struct Buffers {
    size: UVec2,
    /// Premultiplied colour and opacity of every pixel.
    pub eye: Buffer,
    /// Share of the light that reaches a slice, and the next slice.
    pub light: [TextureAndView; 2],
    /// States of every tile of 8x8 pixels, after even and after odd slices (`slices.wgsl`).
    pub tile_states: Buffer,
    /// The number of every slice.
    pub numbers: Buffer,
}

impl DirectionalBuffers {
    /// Makes buffers for windows of up to this size (pixels), and frees buffers of another size. `None` if there are no
    /// windows, or the device has no buffers that large.
    pub fn fit(&mut self, window: UVec2, device: &RenderDevice) -> Option<&Buffers> {
        let size = (window + (GRAIN - 1)) / GRAIN * GRAIN;
        let bytes = 16 * u64::from(size.x) * u64::from(size.y);
        // One ring of pixels around the window.
        let fits = size.max_element() + 2 <= device.limits().max_texture_dimension_2d
            && bytes <= largest_storage_buffer(device);
        if window.min_element() == 0 || !fits {
            self.0 = None;
        } else if self.0.as_ref().is_none_or(|buffers| buffers.size != size) {
            self.0 = Some(Buffers::new(size, bytes, device));
        }
        self.0.as_ref()
    }
}

impl Buffers {
    fn new(size: UVec2, bytes: u64, device: &RenderDevice) -> Self {
        let buffer = |label, size| {
            let (label, usage) = (Some(label), BufferUsages::STORAGE);
            device.create_buffer(&BufferDescriptor { label, size, usage, mapped_at_creation: false })
        };
        let tiles = tile_counts(size);
        let light = |label| {
            let descriptor = TextureDescriptor {
                label: Some(label),
                size: Extent3d { width: size.x + 2, height: size.y + 2, ..default() },
                mip_level_count: 1,
                sample_count: 1,
                dimension: TextureDimension::D2,
                format: LIGHT_FORMAT,
                usage: TextureUsages::STORAGE_BINDING | TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            };
            TextureAndView::new(device, &descriptor, TextureViewDimension::D2)
        };
        let mut numbers = vec![0u32; (DirectionalOcclusion::MAX_SLICES * NUMBER_STRIDE / 4) as usize];
        for (number, place) in (0..).zip(numbers.iter_mut().step_by(NUMBER_STRIDE as usize / 4)) {
            *place = number;
        }
        Self {
            size,
            eye: buffer("contextual_ao_eye", bytes),
            tile_states: buffer("contextual_ao_tile_states", 2 * 4 * u64::from(tiles.element_product())),
            light: ["contextual_ao_light_a", "contextual_ao_light_b"].map(light),
            numbers: device.create_buffer_with_data(&BufferInitDescriptor {
                label: Some("contextual_ao_slice_numbers"),
                contents: bytemuck::cast_slice(&numbers),
                usage: BufferUsages::STORAGE,
            }),
        }
    }

    pub fn usage(&self) -> GpuUsage {
        let textures = self.light.iter().map(|light| &light.texture);
        usage_of(textures) + usage_of_buffers([&self.eye, &self.tile_states, &self.numbers])
    }
}
