//! Step V: the spherical ray cast of the listed voxels.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntry, BindGroupLayoutDescriptor, BindGroupLayoutEntries, BindingResource,
            Buffer, BufferDescriptor, BufferUsages, CachedComputePipelineId, CommandEncoder,
            ComputePipelineDescriptor, PipelineCache, SamplerBindingType, ShaderStages, StorageTextureAccess,
            TextureSampleType,
            binding_types::{
                sampler, storage_buffer, storage_buffer_read_only, storage_buffer_read_only_sized,
                texture_3d, texture_storage_3d, uniform_buffer,
            },
        },
        renderer::RenderDevice,
    },
};

use super::{
    dispatch::{Groups, dispatch},
    formats::Formats,
    volume_bindings,
    volume_store::VolumeResources,
    volume_uniform::OcclusionPassUniform,
};
use crate::diagnostics::COUNTERS;

#[derive(Resource)]
pub(crate) struct RayCastPipeline {
    layout: BindGroupLayoutDescriptor,
    counting_layout: BindGroupLayoutDescriptor,
    pipeline: CachedComputePipelineId,
    counting_pipeline: CachedComputePipelineId,
    /// See `diagnostics::COUNTERS`.
    pub work: Buffer,
}

/// The voxels of one list.
pub(crate) struct RayCastJob {
    group: BindGroup,
    word_list: Buffer,
    voxel_masks: Buffer,
    /// First byte and size of the mask of pending voxels.
    pending: (u64, u64),
    counts: bool,
}

impl FromWorld for RayCastPipeline {
    fn from_world(world: &mut World) -> Self {
        let formats = world.resource::<Formats>();
        let read = storage_buffer_read_only_sized(false, None);
        let mut entries = BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                uniform_buffer::<OcclusionPassUniform>(false),
                texture_3d(TextureSampleType::Float { filterable: true }),
                sampler(SamplerBindingType::Filtering),
                storage_buffer_read_only::<Vec<Vec4>>(false),
                read,
                read,
                texture_storage_3d(formats.scalar, StorageTextureAccess::WriteOnly),
            ),
        )
        .to_vec();
        let layout = BindGroupLayoutDescriptor::new("contextual_ao_ray_cast", &entries);
        entries.push(storage_buffer::<[u32; COUNTERS.len()]>(false).build(7, ShaderStages::COMPUTE));
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
                layout: vec![volume_bindings::bricks_layout(), layout.clone()],
                shader: shader.clone(),
                shader_defs,
                zero_initialize_workgroup_memory: true,
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
                size: 4 * COUNTERS.len() as u64,
                usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
        }
    }
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
        formats: &Formats,
        counts: bool,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> Option<RayCastJob> {
        let bricks = &volume.bricks;
        let mut resources = vec![
            volume.pass.binding()?,
            BindingResource::TextureView(&volume.opacities.view),
            BindingResource::Sampler(&formats.grid_sampler),
            volume.rays.binding()?,
            bricks.word_list.as_entire_binding(),
            bricks.voxel_masks.as_entire_binding(),
            BindingResource::TextureView(&volume.occlusion.view),
        ];
        if counts {
            resources.push(self.work.as_entire_binding());
        }
        let entries: Vec<_> =
            (0..).zip(resources).map(|(binding, resource)| BindGroupEntry { binding, resource }).collect();
        let layout = if counts { &self.counting_layout } else { &self.layout };
        let layout = cache.get_bind_group_layout(layout);
        Some(RayCastJob {
            group: device.create_bind_group("contextual_ao_ray_cast", &layout, &entries),
            word_list: bricks.word_list.clone(),
            voxel_masks: bricks.voxel_masks.clone(),
            pending: bricks.pending(),
            counts,
        })
    }

    /// Casts what is pending; nothing is afterwards.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        volume: &BindGroup,
        job: &RayCastJob,
        cache: &PipelineCache,
    ) {
        let pipeline = if job.counts { self.counting_pipeline } else { self.pipeline };
        if let Some(pipeline) = cache.get_compute_pipeline(pipeline) {
            let groups = [volume, &job.group];
            dispatch(encoder, "contextual_ao_ray_cast", pipeline, groups, Groups::Listed(&job.word_list));
        }
        let (first, size) = job.pending;
        encoder.clear_buffer(&job.voxel_masks, first, Some(size));
    }
}
