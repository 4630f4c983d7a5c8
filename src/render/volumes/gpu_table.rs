//! A volume's lookup table on the GPU: rows of a texture.

use bevy::{
    prelude::*,
    render::{
        render_resource::{
            Extent3d, Origin3d, TexelCopyBufferLayout, TexelCopyTextureInfo, TextureDescriptor,
            TextureDimension, TextureFormat, TextureUsages, TextureViewDimension,
        },
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::{
    blue_noise,
    preintegration::{self, StepLengths},
};
use crate::{render::gpu::textures::TextureAndView, volume::LookupTable};

/// Number of rows for a table of the occlusion method. They are the first.
pub(crate) const METHOD_ROWS: u32 = 2;
/// Number of rows before those of the transfer function. The last one has noise.
const ROWS_BEFORE: u32 = METHOD_ROWS + 1;

/// The texture: [`METHOD_ROWS`], a row of noise, then [`preintegration::ROWS`] for each gradient of the table.
pub(crate) struct GpuTable {
    pub texture: TextureAndView,
    /// The table's revision and the lengths of steps that were uploaded.
    uploaded: Option<(u32, StepLengths)>,
}

impl GpuTable {
    /// Makes an empty table with room for the rows of `table`.
    pub fn new(table: &LookupTable, device: &RenderDevice) -> Self {
        Self { texture: texture(height(table), device), uploaded: None }
    }

    /// Whether there is room for the rows of `table`, and not for more.
    pub fn fits(&self, table: &LookupTable) -> bool {
        self.texture.texture.height() == height(table)
    }

    /// Uploads a volume's table if it changed, or the lengths of steps did. Returns whether it did.
    pub fn upload(&mut self, table: &LookupTable, steps: StepLengths, queue: &RenderQueue) -> bool {
        if self.uploaded.is_none() {
            self.write(METHOD_ROWS, &blue_noise::row(), queue);
        }
        let is_new = self.uploaded.replace((table.revision, steps)) != Some((table.revision, steps));
        if is_new {
            let of_gradients = table.entries.chunks(LookupTable::ENTRIES);
            let rows: Vec<_> =
                of_gradients.flat_map(|entries| preintegration::rows(entries, steps)).collect();
            self.write(ROWS_BEFORE, &rows, queue);
        }
        is_new
    }

    /// Writes the rows of the occlusion method.
    pub fn write_method_rows(&self, rows: &[[f32; 4]], queue: &RenderQueue) {
        self.write(0, rows, queue);
    }

    /// Writes whole rows.
    fn write(&self, first: u32, texels: &[[f32; 4]], queue: &RenderQueue) {
        let width = LookupTable::ENTRIES as u32;
        let origin = Origin3d { y: first, ..default() };
        let layout =
            TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(16 * width), rows_per_image: None };
        queue.write_texture(
            TexelCopyTextureInfo { origin, ..self.texture.texture.as_image_copy() },
            bytemuck::cast_slice(texels),
            layout,
            Extent3d { width, height: texels.len() as u32 / width, ..default() },
        );
    }
}

/// Number of rows of a table's texture.
fn height(table: &LookupTable) -> u32 {
    ROWS_BEFORE + preintegration::ROWS * table.rows()
}

fn texture(height: u32, device: &RenderDevice) -> TextureAndView {
    let descriptor = TextureDescriptor {
        label: Some("contextual_ao_lookup_table"),
        size: Extent3d { width: LookupTable::ENTRIES as u32, height, ..default() },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: TextureFormat::Rgba32Float,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
        view_formats: &[],
    };
    TextureAndView::new(device, &descriptor, TextureViewDimension::D2)
}
