//! Step V: the spherical ray cast of the listed voxels, a slice of the list at a time.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntry, BindGroupLayoutEntries, BindGroupLayoutEntry, BindingResource, Buffer,
            BufferBinding, BufferDescriptor, BufferInitDescriptor, BufferSize, BufferUsages, CommandEncoder,
            IntoBindingArray, PipelineCache, SamplerBindingType, ShaderStages, StorageTextureAccess,
            TextureSampleType,
            binding_types::{
                sampler, storage_buffer, storage_buffer_read_only, storage_buffer_read_only_sized,
                storage_buffer_sized, texture_3d, texture_storage_3d, uniform_buffer,
            },
        },
        renderer::RenderDevice,
    },
};

use super::{
    go_on::RUNNING_MEANS,
    kept::{KeptRays, RayPassUniform},
    slices::{MOST_SLICES, Slices, arguments_of},
};
use crate::{
    diagnostics::COUNTERS,
    render::{
        gpu::{
            compute_pass::{ComputePass, PassDescriptor, are_ready},
            device::Gpu,
            formats::Formats,
        },
        volumes::{layouts::bricks_layout, store::VolumeResources},
    },
};

/// Distance of two slices' numbers in their buffer, bytes: the largest alignment of a dynamic offset.
const NUMBER_BYTES: u32 = 256;

pub(crate) struct RayCastPasses {
    cast: ComputePass,
    /// Variant that counts its work.
    counting: ComputePass,
    /// Variant that adds to the running means of earlier frames.
    progressive: ComputePass,
    /// See `diagnostics::COUNTERS`.
    pub work: Buffer,
    /// The numbers of slices.
    numbers: Buffer,
}

/// Ray cast of the listed voxels of one volume.
pub(crate) struct RayCastJob {
    group: BindGroup,
    state: Buffer,
    pub slices: u32,
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
            let state = storage_buffer_read_only_sized(false, None).build(9, stages);
            let slice = uniform_buffer::<u32>(true).build(10, stages);
            let own: Vec<_> = own.iter().copied().chain(binding).chain([state, slice]).collect();
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
        let numbers = (0..MOST_SLICES).flat_map(|slice| {
            let mut bytes = [0; NUMBER_BYTES as usize];
            bytes[..4].copy_from_slice(&slice.to_le_bytes());
            bytes
        });
        let numbers = BufferInitDescriptor {
            label: Some("contextual_ao_slice_numbers"),
            contents: &numbers.collect::<Vec<_>>(),
            usage: BufferUsages::UNIFORM,
        };
        let counters = storage_buffer::<[u32; COUNTERS.len()]>(false).build(7, stages);
        let running_means = storage_buffer_sized(false, None).build(RUNNING_MEANS, stages);
        Self {
            cast: pass(None, None),
            counting: pass(Some("COUNT_WORK"), Some(counters)),
            progressive: pass(Some("PROGRESSIVE"), Some(running_means)),
            numbers: world.resource::<RenderDevice>().create_buffer_with_data(&numbers),
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
    pub(super) fn bind_volume(
        &self,
        volume: &VolumeResources,
        kept: &mut KeptRays,
        counts: bool,
        slices: Slices,
        gpu: &Gpu,
    ) -> Option<RayCastJob> {
        let state = kept.state.clone()?;
        let (variant, own) = match &kept.running_means {
            Some(means) => (Variant::Progressive, Some((RUNNING_MEANS, means))),
            None if counts => (Variant::Counting, Some((7, &self.work))),
            None => (Variant::Plain, None),
        };
        let (pass, rays) = (kept.pass.buffer()?, kept.rays.buffer()?);
        // The last buffer tells the variant.
        let buffers = [pass, rays, &state, own.map_or(&state, |(_, buffer)| buffer)];
        let bound = (buffers.map(|buffer| buffer.id()), volume.occlusion.view.id());
        let group = kept.cast_group.of(bound, || {
            let (opacities, sampler) = (&volume.opacities.view, &gpu.formats.grid_sampler);
            let [pass, rays, state, own_buffer] = buffers.map(|buffer| buffer.as_entire_binding());
            let words = volume.bricks.word_list.as_entire_binding();
            let masks = volume.bricks.voxel_masks.as_entire_binding();
            let occlusion = &volume.occlusion.view;
            let shared = (opacities, sampler, pass, rays, words, masks, occlusion).into_array();
            let number = BufferBinding { buffer: &self.numbers, offset: 0, size: BufferSize::new(4) };
            let own = own.map(|(binding, _)| (binding, own_buffer));
            let last = [(9, state), (10, BindingResource::Buffer(number))];
            let entries = (0..).zip(shared).chain(own).chain(last);
            let entries: Vec<_> =
                entries.map(|(binding, resource)| BindGroupEntry { binding, resource }).collect();
            self.pass(variant).bind_entries(&entries, &gpu.cache, &gpu.device)
        });
        Some(RayCastJob { group, state, slices: slices.count, variant })
    }

    fn pass(&self, variant: Variant) -> &ComputePass {
        match variant {
            Variant::Plain => &self.cast,
            Variant::Counting => &self.counting,
            Variant::Progressive => &self.progressive,
        }
    }

    /// Casts the pending voxels of a slice. Their mask is clear afterwards, unless more rays follow.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        volume: &BindGroup,
        job: &RayCastJob,
        slice: u32,
        cache: &PipelineCache,
    ) {
        let Some(mut pass) = self.pass(job.variant).begin(encoder, cache) else {
            return;
        };
        pass.set_bind_group(0, &**volume, &[]);
        pass.set_bind_group(1, &*job.group, &[slice * NUMBER_BYTES]);
        pass.dispatch_workgroups_indirect(&job.state, arguments_of(slice));
    }
}
