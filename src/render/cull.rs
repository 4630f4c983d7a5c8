//! Lists the bricks in which clipping may have changed something.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries,
            CachedComputePipelineId, CommandEncoder, ComputePipelineDescriptor, PipelineCache, ShaderStages,
            binding_types::{
                storage_buffer_read_only, storage_buffer_read_only_sized, storage_buffer_sized,
                uniform_buffer,
            },
        },
        renderer::RenderDevice,
    },
};

use super::{
    brick_buffers::work_layout,
    dispatch::{Groups, dispatch},
    formats::Formats,
    volume_bindings,
    volume_store::VolumeResources,
    volume_uniform::{CarverUniform, OcclusionPassUniform},
};

#[derive(Resource)]
pub(crate) struct CullPipeline {
    layout: BindGroupLayoutDescriptor,
    pipeline: CachedComputePipelineId,
}

impl FromWorld for CullPipeline {
    fn from_world(world: &mut World) -> Self {
        let read = storage_buffer_read_only_sized(false, None);
        let layout = BindGroupLayoutDescriptor::new(
            "contextual_ao_cull",
            &BindGroupLayoutEntries::sequential(
                ShaderStages::COMPUTE,
                (
                    uniform_buffer::<OcclusionPassUniform>(false),
                    read,
                    read,
                    storage_buffer_read_only::<Vec<CarverUniform>>(false),
                    storage_buffer_sized(false, None),
                ),
            ),
        );
        let descriptor = ComputePipelineDescriptor {
            label: Some("contextual_ao_cull".into()),
            layout: vec![volume_bindings::compute_layout(), layout.clone(), work_layout()],
            shader: load_embedded_asset!(world, "cull.wgsl"),
            shader_defs: world.resource::<Formats>().shader_defs(),
            ..default()
        };
        Self { pipeline: world.resource::<PipelineCache>().queue_compute_pipeline(descriptor), layout }
    }
}

impl CullPipeline {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        cache.get_compute_pipeline(self.pipeline).is_some()
    }

    pub fn bind(
        &self,
        volume: &VolumeResources,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> Option<BindGroup> {
        Some(device.create_bind_group(
            "contextual_ao_cull",
            &cache.get_bind_group_layout(&self.layout),
            &BindGroupEntries::sequential((
                volume.pass.binding()?,
                volume.bricks.opaque_before.as_entire_binding(),
                volume.bricks.ranges.as_entire_binding(),
                volume.changes.binding()?,
                volume.bricks.near_carvers.as_entire_binding(),
            )),
        ))
    }

    /// Visits all bricks.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        bind_groups: [&BindGroup; 3],
        bricks: u32,
        cache: &PipelineCache,
    ) {
        if let Some(pipeline) = cache.get_compute_pipeline(self.pipeline) {
            dispatch(encoder, "contextual_ao_cull", pipeline, bind_groups, Groups::Bricks(bricks));
        }
    }
}
