//! Steps I and V: the spherical ray cast.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntry, BindGroupLayoutDescriptor, BindGroupLayoutEntries, BindingResource,
            Buffer, BufferDescriptor, BufferUsages, CachedComputePipelineId, CommandEncoder,
            ComputePipelineDescriptor, PipelineCache, SamplerBindingType, ShaderStages, StorageTextureAccess,
            TextureSampleType, TextureView, UniformBuffer,
            binding_types::{
                sampler, storage_buffer, storage_buffer_read_only, texture_3d, texture_storage_3d,
                uniform_buffer,
            },
        },
        renderer::RenderDevice,
    },
};

use super::{
    bricks::dispatch_bricks, formats::Formats, volume_bindings, volume_store::VolumeResources,
    volume_uniform::OcclusionPassUniform,
};

#[derive(Resource)]
pub(crate) struct RayCastPipeline {
    layout: BindGroupLayoutDescriptor,
    counting_layout: BindGroupLayoutDescriptor,
    pipeline: CachedComputePipelineId,
    counting_pipeline: CachedComputePipelineId,
    /// Four words: see `diagnostics::COUNTERS`.
    pub work: Buffer,
}

impl FromWorld for RayCastPipeline {
    fn from_world(world: &mut World) -> Self {
        let formats = world.resource::<Formats>();
        let filtered = TextureSampleType::Float { filterable: true };
        let mut entries = BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                uniform_buffer::<OcclusionPassUniform>(false),
                texture_storage_3d(formats.scalar, StorageTextureAccess::WriteOnly),
                texture_3d(filtered),
                texture_3d(filtered),
                texture_3d(filtered),
                sampler(SamplerBindingType::Filtering),
                storage_buffer_read_only::<Vec<Vec4>>(false),
            ),
        )
        .to_vec();
        let layout = BindGroupLayoutDescriptor::new("contextual_ao_ray_cast", &entries);
        entries.push(storage_buffer::<[u32; 4]>(false).build(7, ShaderStages::COMPUTE));
        let counting_layout = BindGroupLayoutDescriptor::new("contextual_ao_ray_cast_counting", &entries);

        let shader: Handle<Shader> = load_embedded_asset!(world, "ray_cast.wgsl");
        let cache = world.resource::<PipelineCache>();
        let queue = |layout: &BindGroupLayoutDescriptor, counts: bool| {
            let mut shader_defs = formats.shader_defs();
            if counts {
                shader_defs.push("COUNT_WORK".into());
            }
            cache.queue_compute_pipeline(ComputePipelineDescriptor {
                label: Some(layout.label.clone()),
                layout: vec![volume_bindings::compute_layout(), layout.clone()],
                shader: shader.clone(),
                shader_defs,
                ..default()
            })
        };
        Self {
            pipeline: queue(&layout, false),
            counting_pipeline: queue(&counting_layout, true),
            layout,
            counting_layout,
            work: world.resource::<RenderDevice>().create_buffer(&BufferDescriptor {
                label: Some("contextual_ao_work"),
                size: 16,
                usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
        }
    }
}

/// Where a ray cast reads and writes occlusion.
pub(crate) struct RayCastTarget<'a> {
    pub pass: &'a UniformBuffer<OcclusionPassUniform>,
    pub written: &'a TextureView,
    /// Copied where a voxel is unaffected; not read when every voxel is cast.
    pub unclipped: &'a TextureView,
}

impl RayCastPipeline {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        [self.pipeline, self.counting_pipeline]
            .into_iter()
            .all(|pipeline| cache.get_compute_pipeline(pipeline).is_some())
    }

    pub fn bind(
        &self,
        volume: &VolumeResources,
        target: RayCastTarget,
        formats: &Formats,
        counts: bool,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> Option<BindGroup> {
        let mut resources = vec![
            target.pass.binding()?,
            BindingResource::TextureView(target.written),
            BindingResource::TextureView(&volume.opacities.view),
            BindingResource::TextureView(&volume.categories.view),
            BindingResource::TextureView(target.unclipped),
            BindingResource::Sampler(&formats.grid_sampler),
            volume.rays.binding()?,
        ];
        if counts {
            resources.push(self.work.as_entire_binding());
        }
        let entries: Vec<_> =
            (0..).zip(resources).map(|(binding, resource)| BindGroupEntry { binding, resource }).collect();
        let layout = if counts { &self.counting_layout } else { &self.layout };
        Some(device.create_bind_group(
            "contextual_ao_ray_cast",
            &cache.get_bind_group_layout(layout),
            &entries,
        ))
    }

    /// Visits `bricks` bricks from the pass's first on.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        groups: [&BindGroup; 2],
        bricks: u32,
        counts: bool,
        cache: &PipelineCache,
    ) {
        let pipeline = if counts { self.counting_pipeline } else { self.pipeline };
        if let Some(pipeline) = cache.get_compute_pipeline(pipeline) {
            dispatch_bricks(encoder, "contextual_ao_ray_cast", pipeline, groups, bricks);
        }
    }
}
