//! Counts the surfaces of a clip mesh along the lines of sight of its clip camera, on the GPU. A changed mesh is
//! counted again.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupLayoutEntries, Buffer, BufferDescriptor, BufferUsages, CommandEncoder,
            PipelineCache, ShaderStages, TextureSampleType,
            binding_types::{storage_buffer_sized, texture_2d},
        },
        renderer::RenderDevice,
    },
};

use super::{
    clip_draw::{ClipMeshDraw, Draw, MeshSource},
    clip_keys::DepthKey,
    clip_maps::ClipMaps,
    clip_textures::ClipTextures,
    surface_count::SurfaceCount,
};
use crate::render::gpu::compute_pass::{ComputePass, Groups, PassDescriptor};

const BYTES: u64 = 4;

/// Requests the counts that were made in this frame.
pub(crate) fn request_counts(mut clip_maps: ResMut<ClipMaps>, device: Res<RenderDevice>) {
    for slot in clip_maps.slots.values_mut() {
        slot.count.request(&device);
    }
}

#[derive(Resource, Deref)]
pub(crate) struct CountPass(ComputePass);

impl FromWorld for CountPass {
    fn from_world(world: &mut World) -> Self {
        let own = BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                texture_2d(TextureSampleType::Float { filterable: false }),
                storage_buffer_sized(false, core::num::NonZeroU64::new(BYTES)),
            ),
        );
        let descriptor = PassDescriptor {
            name: "contextual_ao_count_surfaces",
            shader: load_embedded_asset!(world, "count_surfaces.wgsl"),
            own: &own,
            ..default()
        };
        Self(ComputePass::new(world, descriptor))
    }
}

impl CountPass {
    /// Prepares to count the surfaces of a mesh. `None` while another count is under way.
    pub fn begin(
        &self,
        draw: ClipMeshDraw,
        key: DepthKey,
        count: &mut SurfaceCount,
        textures: &ClipTextures,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> Option<CountJob> {
        let staging = count.begin(key, device)?;
        let most = device.create_buffer(&BufferDescriptor {
            label: Some("contextual_ao_surface_count"),
            size: BYTES,
            usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let group = self.bind((&textures.counts.view, most.as_entire_binding()), cache, device);
        Some(CountJob { draw, group, most, staging })
    }
}

/// One mesh whose surfaces are to be counted.
pub(crate) struct CountJob {
    draw: ClipMeshDraw,
    group: BindGroup,
    most: Buffer,
    staging: Buffer,
}

impl CountJob {
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        pass: &CountPass,
        textures: &ClipTextures,
        source: &MeshSource,
    ) {
        self.draw.encode(Draw::Count, encoder, &textures.counts.view, None, source);
        // An invocation has 16x16 texels, a workgroup 8x8 invocations.
        let groups = Groups::Square(textures.depth_map_size.div_ceil(16 * 8));
        pass.encode(encoder, [&self.group], groups, source.cache);
        encoder.copy_buffer_to_buffer(&self.most, 0, &self.staging, 0, BYTES);
    }
}
