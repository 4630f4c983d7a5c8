//! Step IV: opacity and category of every voxel.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries,
            CachedComputePipelineId, CommandEncoder, ComputePipelineDescriptor, PipelineCache, ShaderStages,
            StorageTextureAccess, UniformBuffer,
            binding_types::{texture_storage_3d, uniform_buffer},
        },
        renderer::RenderDevice,
    },
};

use super::{
    bricks::dispatch_bricks, formats::Formats, volume_bindings, volume_store::VolumeResources,
    volume_uniform::OcclusionPassUniform,
};

#[derive(Resource)]
pub(crate) struct ClassifyPipeline {
    layout: BindGroupLayoutDescriptor,
    pipeline: CachedComputePipelineId,
}

impl FromWorld for ClassifyPipeline {
    fn from_world(world: &mut World) -> Self {
        let formats = world.resource::<Formats>();
        let written = || texture_storage_3d(formats.scalar, StorageTextureAccess::WriteOnly);
        let layout = BindGroupLayoutDescriptor::new(
            "contextual_ao_classify",
            &BindGroupLayoutEntries::sequential(
                ShaderStages::COMPUTE,
                (uniform_buffer::<OcclusionPassUniform>(false), written(), written()),
            ),
        );
        let descriptor = ComputePipelineDescriptor {
            label: Some("contextual_ao_classify".into()),
            layout: vec![volume_bindings::compute_layout(), layout.clone()],
            shader: load_embedded_asset!(world, "classify.wgsl"),
            shader_defs: formats.shader_defs(),
            ..default()
        };
        Self { pipeline: world.resource::<PipelineCache>().queue_compute_pipeline(descriptor), layout }
    }
}

impl ClassifyPipeline {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        cache.get_compute_pipeline(self.pipeline).is_some()
    }

    pub fn bind(
        &self,
        volume: &VolumeResources,
        pass: &UniformBuffer<OcclusionPassUniform>,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> Option<BindGroup> {
        Some(device.create_bind_group(
            "contextual_ao_classify",
            &cache.get_bind_group_layout(&self.layout),
            &BindGroupEntries::sequential((pass.binding()?, &volume.opacities.view, &volume.categories.view)),
        ))
    }

    /// Visits `bricks` bricks from the pass's first on.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        groups: [&BindGroup; 2],
        bricks: u32,
        cache: &PipelineCache,
    ) {
        if let Some(pipeline) = cache.get_compute_pipeline(self.pipeline) {
            dispatch_bricks(encoder, "contextual_ao_classify", pipeline, groups, bricks);
        }
    }
}
