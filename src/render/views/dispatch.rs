//! Passes over the pixels of a volume's views: their uniform arrays, and their dispatch.

use bevy::{
    prelude::*,
    render::render_resource::{
        BindGroup, BindingResource, Buffer, BufferBinding, BufferSize, BufferUsages, CommandEncoder,
        PipelineCache, ShaderSize, StorageBuffer, encase::internal::WriteInto,
    },
};

use crate::render::gpu::{compute_pass::ComputePass, device::Gpu};

/// Most views in one dispatch, `VIEWS` in WGSL.
pub(crate) const VIEWS_AT_ONCE: u32 = 16;

/// A value for each view of a volume. Shaders bind `VIEWS_AT_ONCE` or one of them as a uniform, at a dynamic offset.
#[derive(Default)]
pub(crate) struct ViewArray<T: ShaderSize>(StorageBuffer<Vec<T>>);

impl<T: ShaderSize + WriteInto + Clone + Default + PartialEq> ViewArray<T> {
    /// Bytes of a value.
    pub const BYTES: u32 = T::SHADER_SIZE.get() as u32;

    /// Writes the values if they changed.
    pub fn write(&mut self, mut values: Vec<T>, gpu: &Gpu) {
        // Whole arrays are bound, from any value on.
        values.resize(values.len() + VIEWS_AT_ONCE as usize, T::default());
        if *self.0.get() != values {
            self.0.add_usages(BufferUsages::UNIFORM);
            self.0.set(values);
            self.0.write_buffer(&gpu.device, &gpu.queue);
        }
    }

    /// The values, as last written.
    pub fn get(&self) -> &[T] {
        self.0.get()
    }

    pub fn buffer(&self) -> Option<&Buffer> {
        self.0.buffer()
    }

    /// Binding of some successive values in a buffer of such values.
    pub fn binding(buffer: &Buffer, count: u32) -> BindingResource<'_> {
        let size = BufferSize::new(u64::from(count * Self::BYTES));
        BindingResource::Buffer(BufferBinding { buffer, offset: 0, size })
    }
}

/// Views of a volume, with the part of each that a pass visits.
#[derive(Clone, Copy)]
pub(crate) struct ViewParts {
    /// Size of the largest part, pixels.
    pub largest: UVec2,
    /// First view, and number of views.
    pub first: u32,
    pub count: u32,
}

/// Encodes a pass over parts of views, with as many views as possible in each dispatch. Group 1 binds uniform arrays of
/// views, whose elements have the sizes `bytes`; the other groups have no offsets.
pub(crate) fn encode_views(
    pass: &ComputePass,
    encoder: &mut CommandEncoder,
    groups: &[&BindGroup],
    bytes: &[u32],
    parts: ViewParts,
    cache: &PipelineCache,
) {
    let Some(mut pass) = pass.begin(encoder, cache) else {
        return;
    };
    let tiles = (parts.largest + 7) / 8;
    let end = parts.first + parts.count;
    for first in (parts.first..end).step_by(VIEWS_AT_ONCE as usize) {
        let offsets: Vec<u32> = bytes.iter().map(|bytes| bytes * first).collect();
        for (index, group) in (0..).zip(groups) {
            pass.set_bind_group(index, &***group, if index == 1 { &offsets } else { &[] });
        }
        let views = (end - first).min(VIEWS_AT_ONCE);
        pass.dispatch_workgroups(tiles.x, tiles.y, views);
    }
}
