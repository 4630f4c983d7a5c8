//! The range of intensities around every brick, once per volume.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries,
            CachedComputePipelineId, CommandEncoder, ComputePipelineDescriptor, PipelineCache, ShaderStages,
            binding_types::storage_buffer_sized,
        },
        renderer::RenderDevice,
    },
};

use super::{
    brick_buffers::BrickBuffers,
    dispatch::{Groups, dispatch},
    formats::Formats,
    volume_bindings,
};

#[derive(Resource)]
pub(crate) struct RangesPipeline {
    layout: BindGroupLayoutDescriptor,
    pipeline: CachedComputePipelineId,
}

impl FromWorld for RangesPipeline {
    fn from_world(world: &mut World) -> Self {
        let layout = BindGroupLayoutDescriptor::new(
            "contextual_ao_ranges",
            &BindGroupLayoutEntries::single(ShaderStages::COMPUTE, storage_buffer_sized(false, None)),
        );
        let descriptor = ComputePipelineDescriptor {
            label: Some("contextual_ao_ranges".into()),
            layout: vec![volume_bindings::compute_layout(), layout.clone()],
            shader: load_embedded_asset!(world, "ranges.wgsl"),
            shader_defs: world.resource::<Formats>().shader_defs(),
            ..default()
        };
        Self { pipeline: world.resource::<PipelineCache>().queue_compute_pipeline(descriptor), layout }
    }
}

impl RangesPipeline {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        cache.get_compute_pipeline(self.pipeline).is_some()
    }

    pub fn bind(&self, bricks: &BrickBuffers, cache: &PipelineCache, device: &RenderDevice) -> BindGroup {
        device.create_bind_group(
            "contextual_ao_ranges",
            &cache.get_bind_group_layout(&self.layout),
            &BindGroupEntries::single(bricks.ranges.as_entire_binding()),
        )
    }

    /// Visits all bricks.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        bind_groups: [&BindGroup; 2],
        bricks: u32,
        cache: &PipelineCache,
    ) {
        if let Some(pipeline) = cache.get_compute_pipeline(self.pipeline) {
            dispatch(encoder, "contextual_ao_ranges", pipeline, bind_groups, Groups::Bricks(bricks));
        }
    }
}
