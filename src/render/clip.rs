//! Step IV: what carvers leave of the voxels in the listed bricks.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, Buffer,
            CachedComputePipelineId, CommandEncoder, ComputePipelineDescriptor, PipelineCache, ShaderStages,
            StorageTextureAccess,
            binding_types::{
                storage_buffer_read_only, storage_buffer_read_only_sized, texture_storage_3d, uniform_buffer,
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
pub(crate) struct ClipPipeline {
    layout: BindGroupLayoutDescriptor,
    pipeline: CachedComputePipelineId,
}

impl FromWorld for ClipPipeline {
    fn from_world(world: &mut World) -> Self {
        let formats = world.resource::<Formats>();
        let read = storage_buffer_read_only_sized(false, None);
        let layout = BindGroupLayoutDescriptor::new(
            "contextual_ao_clip",
            &BindGroupLayoutEntries::sequential(
                ShaderStages::COMPUTE,
                (
                    uniform_buffer::<OcclusionPassUniform>(false),
                    read,
                    read,
                    storage_buffer_read_only::<Vec<CarverUniform>>(false),
                    read,
                    texture_storage_3d(formats.scalar, StorageTextureAccess::WriteOnly),
                ),
            ),
        );
        let descriptor = ComputePipelineDescriptor {
            label: Some("contextual_ao_clip".into()),
            layout: vec![volume_bindings::bricks_layout(), layout.clone(), work_layout()],
            shader: load_embedded_asset!(world, "clip.wgsl"),
            shader_defs: formats.shader_defs(),
            zero_initialize_workgroup_memory: true,
            ..default()
        };
        Self { pipeline: world.resource::<PipelineCache>().queue_compute_pipeline(descriptor), layout }
    }
}

impl ClipPipeline {
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
            "contextual_ao_clip",
            &cache.get_bind_group_layout(&self.layout),
            &BindGroupEntries::sequential((
                volume.pass.binding()?,
                volume.bricks.opaque_before.as_entire_binding(),
                volume.bricks.ranges.as_entire_binding(),
                volume.changes.binding()?,
                volume.bricks.brick_list.as_entire_binding(),
                &volume.opacities.view,
            )),
        ))
    }

    /// Visits the bricks of a list.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        bind_groups: [&BindGroup; 3],
        list: &Buffer,
        cache: &PipelineCache,
    ) {
        if let Some(pipeline) = cache.get_compute_pipeline(self.pipeline) {
            dispatch(encoder, "contextual_ao_clip", pipeline, bind_groups, Groups::Listed(list));
        }
    }
}
