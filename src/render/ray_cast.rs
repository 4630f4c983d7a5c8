//! Step V: the spherical ray cast of the listed voxels.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupLayoutEntries, Buffer, BufferDescriptor, BufferUsages, CommandEncoder,
            PipelineCache, SamplerBindingType, ShaderStages, StorageTextureAccess, TextureSampleType,
            binding_types::{
                sampler, storage_buffer, storage_buffer_read_only, storage_buffer_read_only_sized,
                texture_3d, texture_storage_3d, uniform_buffer,
            },
        },
        renderer::RenderDevice,
    },
};

use super::{
    brick_resources::PENDING,
    compute_pass::{ComputePass, Groups, ListEnd, PassDescriptor},
    formats::Formats,
    pass_uniforms::OcclusionPassUniform,
    volume_bindings,
    volume_store::VolumeResources,
};
use crate::diagnostics::COUNTERS;

#[derive(Resource)]
pub(crate) struct RayCastPasses {
    cast: ComputePass,
    /// Counts its work.
    counting: ComputePass,
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

impl FromWorld for RayCastPasses {
    fn from_world(world: &mut World) -> Self {
        let read = storage_buffer_read_only_sized(false, None);
        let mut own = BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                texture_3d(TextureSampleType::Float { filterable: true }),
                sampler(SamplerBindingType::Filtering),
                uniform_buffer::<OcclusionPassUniform>(false),
                storage_buffer_read_only::<Vec<Vec4>>(false),
                read,
                read,
                texture_storage_3d(world.resource::<Formats>().scalar, StorageTextureAccess::WriteOnly),
            ),
        )
        .to_vec();
        let shader: Handle<Shader> = load_embedded_asset!(world, "ray_cast.wgsl");
        let pass = |own: &[_], counts: bool| {
            let descriptor = PassDescriptor {
                name: "contextual_ao_ray_cast",
                shader: shader.clone(),
                shader_defs: counts.then(|| "COUNT_WORK".into()).into_iter().collect(),
                before: vec![volume_bindings::bricks_layout()],
                own,
                zeroes_memory: true,
                ..default()
            };
            ComputePass::new(world, descriptor)
        };
        let cast = pass(&own, false);
        own.push(storage_buffer::<[u32; COUNTERS.len()]>(false).build(7, ShaderStages::COMPUTE));
        Self {
            cast,
            counting: pass(&own, true),
            work: world.resource::<RenderDevice>().create_buffer(&BufferDescriptor {
                label: Some("contextual_ao_work"),
                size: 4 * COUNTERS.len() as u64,
                usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
        }
    }
}

impl RayCastPasses {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        self.cast.is_ready(cache) && self.counting.is_ready(cache)
    }

    pub fn bind_volume(
        &self,
        volume: &VolumeResources,
        formats: &Formats,
        counts: bool,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> Option<RayCastJob> {
        let bricks = &volume.bricks;
        let (opacities, sampler) = (&volume.opacities.view, &formats.grid_sampler);
        let (pass, rays) = (volume.pass.binding()?, volume.rays.binding()?);
        let words = bricks.word_list.as_entire_binding();
        let masks = bricks.voxel_masks.as_entire_binding();
        let occlusion = &volume.occlusion.view;
        let group = if counts {
            let work = self.work.as_entire_binding();
            let resources = (opacities, sampler, pass, rays, words, masks, occlusion, work);
            self.counting.bind(resources, cache, device)
        } else {
            self.cast.bind((opacities, sampler, pass, rays, words, masks, occlusion), cache, device)
        };
        Some(RayCastJob {
            group,
            word_list: bricks.word_list.clone(),
            voxel_masks: bricks.voxel_masks.clone(),
            pending: bricks.mask(PENDING),
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
        let pass = if job.counts { &self.counting } else { &self.cast };
        pass.encode(encoder, [volume, &job.group], Groups::Listed(&job.word_list, ListEnd::Front), cache);
        let (first, size) = job.pending;
        encoder.clear_buffer(&job.voxel_masks, first, Some(size));
    }
}
