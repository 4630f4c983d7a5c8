//! GPU resources for a volume's bricks and superbricks and, as masks, for its voxels.

use bevy::{
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, Buffer,
            BufferDescriptor, BufferUsages, PipelineCache, ShaderStages, TextureFormat, TextureUsages,
            TextureViewDimension, binding_types::storage_buffer_sized,
        },
        renderer::{RenderDevice, RenderQueue},
    },
};

use crate::{
    diagnostics::GpuUsage,
    render::gpu::{
        compute_pass::{LIST_HEAD, brick_counts, superbrick_counts},
        formats::volume_texture,
        textures::{TextureAndView, usage_of, usage_of_buffers},
    },
    volume::LookupTable,
};

/// Number of words in the mask of a brick's voxels.
pub(crate) const MASK_WORDS: u32 = 2;
/// Number of masks of voxels (`bricks.wgsl`); `PENDING` is the mask of the voxels to be cast.
pub(crate) const MASKS: u32 = 3;
pub(crate) const PENDING: u32 = 1;
/// Number of words of a superbrick's state (`superbricks.wgsl`).
const SUPERBRICK_WORDS: u32 = 3;
/// Lists of superbricks: changed ones in front, those whose distances may change at the back.
const SUPERBRICK_LISTS: u32 = 2;
/// Format of one number for every brick, which compute passes can write on any device.
pub(crate) const BRICK_FORMAT: TextureFormat = TextureFormat::R32Uint;
/// Number of words before the items of a list: the heads of its two ends (`work_list.wgsl`).
pub(crate) const LIST_HEADS: u32 = 2 * LIST_HEAD;

/// Buffers and textures of one volume.
pub(crate) struct BrickResources {
    /// Number of bricks.
    pub bricks: u32,
    /// Number of superbricks along each axis.
    pub superbrick_counts: UVec3,
    /// Of each brick: lowest and highest intensity around it, 16 bits each, and its smoothing (`ranges.wgsl`).
    pub ranges: Buffer,
    /// Number of lookup table entries with opacity before each entry.
    pub opaque_before: Buffer,
    /// For each brick, a bit for every carver near it (`bricks.wgsl`).
    pub near_carvers: Buffer,
    /// The same bits with the distance that rays may leap, as rays read them.
    pub words: TextureAndView,
    /// Distance of each brick from the nearest brick that the transfer function does not make transparent.
    pub static_distances: TextureAndView,
    /// State of every superbrick.
    pub superbricks: Buffer,
    /// Superbricks to visit.
    pub superbrick_list: Buffer,
    /// Masks of valid, pending and hidden voxels.
    pub voxel_masks: Buffer,
    /// Bricks to be clipped and, at the back, bricks in which only occlusion may be stale.
    pub brick_list: Buffer,
    /// Words of the mask of pending voxels that have any such voxel.
    pub word_list: Buffer,
}

impl BrickResources {
    pub fn new(dimensions: UVec3, device: &RenderDevice) -> Self {
        let counts = brick_counts(dimensions);
        let bricks = counts.element_product();
        let superbrick_counts = superbrick_counts(dimensions);
        let superbricks = superbrick_counts.element_product();
        // Read along rays, where textures are faster than buffers.
        let texture = |label| {
            let descriptor = volume_texture(label, counts, BRICK_FORMAT, TextureUsages::STORAGE_BINDING);
            TextureAndView::new(device, &descriptor, TextureViewDimension::D3)
        };
        let buffer = |label, words: u32| {
            device.create_buffer(&BufferDescriptor {
                label: Some(label),
                size: 4 * words as u64,
                usage: BufferUsages::STORAGE
                    | BufferUsages::COPY_DST
                    | BufferUsages::COPY_SRC
                    | BufferUsages::INDIRECT,
                mapped_at_creation: false,
            })
        };
        Self {
            bricks,
            superbrick_counts,
            ranges: buffer("contextual_ao_ranges", 2 * bricks),
            opaque_before: buffer("contextual_ao_opaque_before", LookupTable::ENTRIES as u32 + 1),
            near_carvers: buffer("contextual_ao_near_carvers", bricks),
            words: texture("contextual_ao_brick_words"),
            static_distances: texture("contextual_ao_static_distances"),
            superbricks: buffer("contextual_ao_superbricks", SUPERBRICK_WORDS * superbricks),
            superbrick_list: buffer(
                "contextual_ao_superbrick_list",
                LIST_HEADS + SUPERBRICK_LISTS * superbricks,
            ),
            voxel_masks: buffer("contextual_ao_voxel_masks", MASKS * MASK_WORDS * bricks),
            brick_list: buffer("contextual_ao_brick_list", LIST_HEADS + bricks),
            word_list: buffer("contextual_ao_word_list", LIST_HEADS + MASK_WORDS * bricks),
        }
    }

    /// Empties a list, before a pass appends to it.
    pub fn empty(list: &Buffer, queue: &RenderQueue) {
        queue.write_buffer(list, 0, bytemuck::cast_slice(&[0u32, 1, 1, 0, 0, 1, 1, 0]));
    }

    /// First byte and size of a mask of voxels.
    pub fn mask(&self, mask: u32) -> (u64, u64) {
        let bytes = self.voxel_masks.size() / MASKS as u64;
        (mask as u64 * bytes, bytes)
    }

    pub fn usage(&self) -> GpuUsage {
        let buffers = [
            &self.ranges,
            &self.opaque_before,
            &self.near_carvers,
            &self.superbricks,
            &self.superbrick_list,
            &self.voxel_masks,
            &self.brick_list,
            &self.word_list,
        ];
        let textures = [&self.words, &self.static_distances];
        usage_of(textures.map(|texture| &texture.texture)) + usage_of_buffers(buffers)
    }
}

/// The layout of group 2: a list, and the masks of voxels.
pub(crate) fn work_layout() -> BindGroupLayoutDescriptor {
    let written = storage_buffer_sized(false, None);
    BindGroupLayoutDescriptor::new(
        "contextual_ao_work",
        &BindGroupLayoutEntries::sequential(ShaderStages::COMPUTE, (written, written)),
    )
}

/// Group 2 of a pass that appends to `list`, or only writes the masks.
pub(crate) fn work_group(
    bricks: &BrickResources,
    list: &Buffer,
    cache: &PipelineCache,
    device: &RenderDevice,
) -> BindGroup {
    device.create_bind_group(
        "contextual_ao_work",
        &cache.get_bind_group_layout(&work_layout()),
        &BindGroupEntries::sequential((list.as_entire_binding(), bricks.voxel_masks.as_entire_binding())),
    )
}
