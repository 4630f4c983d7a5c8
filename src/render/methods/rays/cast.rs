//! Step V: the spherical ray cast of the listed voxels.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntry, BindGroupLayoutEntries, BindGroupLayoutEntry, Buffer,
            BufferDescriptor, BufferUsages, CommandEncoder, IntoBindingArray, PipelineCache,
            SamplerBindingType, ShaderStages, StorageTextureAccess, TextureSampleType,
            binding_types::{
                sampler, storage_buffer, storage_buffer_read_only, storage_buffer_read_only_sized,
                storage_buffer_sized, texture_3d, texture_storage_3d, uniform_buffer,
            },
        },
        renderer::RenderDevice,
    },
};

use super::kept::{KeptRays, RayPassUniform};
use crate::{
    diagnostics::COUNTERS,
    render::{
        gpu::{
            compute_pass::{ComputePass, Groups, ListEnd, PassDescriptor, are_ready},
            device::Gpu,
            formats::Formats,
        },
        volumes::{layouts::bricks_layout, store::VolumeResources},
    },
};

pub(crate) struct RayCastPasses {
    cast: ComputePass,
    /// Variant that counts its work.
    counting: ComputePass,
    /// Variant that adds to the sums of earlier frames.
    progressive: ComputePass,
    /// See `diagnostics::COUNTERS`.
    pub work: Buffer,
}

/// Ray cast of the listed voxels of one volume.
pub(crate) struct RayCastJob {
    group: BindGroup,
    word_list: Buffer,
    variant: Variant,
}

#[derive(Clone, Copy)]
enum Variant {
    Plain,
    Counting,
    Progressive,
}

impl FromWorld for RayCastPasses {
    fn from_world(world: &mut World) -> Self {
        let read = storage_buffer_read_only_sized(false, None);
        let own = BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                texture_3d(TextureSampleType::Float { filterable: true }),
                sampler(SamplerBindingType::Filtering),
                uniform_buffer::<RayPassUniform>(false),
                storage_buffer_read_only::<Vec<Vec4>>(false),
                read,
                storage_buffer_sized(false, None),
                texture_storage_3d(world.resource::<Formats>().scalar, StorageTextureAccess::WriteOnly),
            ),
        )
        .to_vec();
        let shader: Handle<Shader> = load_embedded_asset!(world, "cast.wgsl");
        let stages = ShaderStages::COMPUTE;
        let pass = |shader_def: Option<&'static str>, binding: Option<BindGroupLayoutEntry>| {
            let own: Vec<_> = own.iter().copied().chain(binding).collect();
            let descriptor = PassDescriptor {
                name: "contextual_ao_ray_cast",
                shader: shader.clone(),
                shader_defs: shader_def.map(Into::into).into_iter().collect(),
                before: vec![bricks_layout()],
                own: &own,
                zeroes_memory: true,
                ..default()
            };
            ComputePass::new(world, descriptor)
        };
        let counters = storage_buffer::<[u32; COUNTERS.len()]>(false).build(7, stages);
        let ray_sums = storage_buffer_sized(false, None).build(8, stages);
        Self {
            cast: pass(None, None),
            counting: pass(Some("COUNT_WORK"), Some(counters)),
            progressive: pass(Some("PROGRESSIVE"), Some(ray_sums)),
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
    pub fn is_ready(&self, counts_work: bool, cache: &PipelineCache) -> bool {
        let counting = counts_work.then_some(&self.counting);
        are_ready(counting.into_iter().chain([&self.cast]), cache)
    }

    pub fn progressive_is_ready(&self, cache: &PipelineCache) -> bool {
        self.progressive.is_ready(cache)
    }

    /// Binds the resources of a volume.
    pub fn bind_volume(
        &self,
        volume: &VolumeResources,
        kept: &KeptRays,
        counts: bool,
        gpu: &Gpu,
    ) -> Option<RayCastJob> {
        let bricks = &volume.bricks;
        let (opacities, sampler) = (&volume.opacities.view, &gpu.formats.grid_sampler);
        let (pass, rays) = (kept.pass.binding()?, kept.rays.binding()?);
        let words = bricks.word_list.as_entire_binding();
        let masks = bricks.voxel_masks.as_entire_binding();
        let occlusion = &volume.occlusion.view;
        let (variant, own) = match &kept.ray_sums {
            Some(sums) => (Variant::Progressive, Some((8, sums.as_entire_binding()))),
            None if counts => (Variant::Counting, Some((7, self.work.as_entire_binding()))),
            None => (Variant::Plain, None),
        };
        let shared = (opacities, sampler, pass, rays, words, masks, occlusion).into_array();
        let shared = (0..).zip(shared).map(|(binding, resource)| BindGroupEntry { binding, resource });
        let own = own.map(|(binding, resource)| BindGroupEntry { binding, resource });
        let entries: Vec<_> = shared.chain(own).collect();
        let group = self.pass(variant).bind_entries(&entries, &gpu.cache, &gpu.device);
        Some(RayCastJob { group, word_list: bricks.word_list.clone(), variant })
    }

    fn pass(&self, variant: Variant) -> &ComputePass {
        match variant {
            Variant::Plain => &self.cast,
            Variant::Counting => &self.counting,
            Variant::Progressive => &self.progressive,
        }
    }

    /// Casts the pending voxels. Their mask is clear afterwards, unless more rays follow.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        volume: &BindGroup,
        job: &RayCastJob,
        cache: &PipelineCache,
    ) {
        let listed = Groups::Listed(&job.word_list, ListEnd::Front);
        self.pass(job.variant).encode(encoder, [volume, &job.group], listed, cache);
    }
}
