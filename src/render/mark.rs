//! Which voxels a view will read.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries,
            CachedComputePipelineId, CommandEncoder, ComputePipelineDescriptor, PipelineCache, ShaderStages,
            ShaderType, UniformBuffer, binding_types::uniform_buffer,
        },
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::{
    brick_buffers::work_layout,
    dispatch::{Groups, dispatch},
    formats::Formats,
    volume_bindings,
};

/// A view of a volume, as `Window` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct WindowUniform {
    pub view_from_clip: Mat4,
    pub world_from_view: Mat4,
    /// Origin and size, pixels.
    pub viewport: Vec4,
    /// Pixels in which the volume may be seen.
    pub first: UVec2,
    pub end: UVec2,
}

/// One view to be followed.
pub(crate) struct MarkJob {
    window: BindGroup,
    pixels: UVec2,
}

#[derive(Resource)]
pub(crate) struct MarkPipeline {
    layout: BindGroupLayoutDescriptor,
    pipeline: CachedComputePipelineId,
}

impl FromWorld for MarkPipeline {
    fn from_world(world: &mut World) -> Self {
        let layout = BindGroupLayoutDescriptor::new(
            "contextual_ao_mark",
            &BindGroupLayoutEntries::single(ShaderStages::COMPUTE, uniform_buffer::<WindowUniform>(false)),
        );
        let descriptor = ComputePipelineDescriptor {
            label: Some("contextual_ao_mark".into()),
            layout: vec![volume_bindings::bricks_layout(), layout.clone(), work_layout()],
            shader: load_embedded_asset!(world, "mark.wgsl"),
            shader_defs: world.resource::<Formats>().shader_defs(),
            ..default()
        };
        Self { pipeline: world.resource::<PipelineCache>().queue_compute_pipeline(descriptor), layout }
    }
}

impl MarkPipeline {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        cache.get_compute_pipeline(self.pipeline).is_some()
    }

    pub fn bind(
        &self,
        window: WindowUniform,
        cache: &PipelineCache,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) -> Option<MarkJob> {
        let mut uniform = UniformBuffer::from(window);
        uniform.write_buffer(device, queue);
        let group = device.create_bind_group(
            "contextual_ao_mark",
            &cache.get_bind_group_layout(&self.layout),
            &BindGroupEntries::single(uniform.binding()?),
        );
        Some(MarkJob { window: group, pixels: window.end - window.first })
    }

    /// Follows the rays of a view.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        volume: &BindGroup,
        job: &MarkJob,
        work: &BindGroup,
        cache: &PipelineCache,
    ) {
        if let Some(pipeline) = cache.get_compute_pipeline(self.pipeline) {
            let groups = [volume, &job.window, work];
            dispatch(encoder, "contextual_ao_mark", pipeline, groups, Groups::Pixels(job.pixels));
        }
    }
}
