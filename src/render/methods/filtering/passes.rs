//! The passes of occlusion by filtering over one volume.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroup, BindGroupEntry, BindGroupLayoutEntries, BindGroupLayoutEntryBuilder, BindingResource,
        CommandEncoder, PipelineCache, ShaderStages, StorageTextureAccess, TextureFormat, TextureSampleType,
        binding_types::{
            storage_buffer_read_only, storage_buffer_read_only_sized, storage_buffer_sized, texture_3d,
            texture_storage_3d, uniform_buffer,
        },
    },
    shader::ShaderDefVal,
};

use super::{
    resources::{FilteringData, FilteringResources},
    steps::{self, AXES, Outcome, Quantity, Step},
};
use crate::render::{
    gpu::{
        compute_pass::{ComputePass, Groups, PassDescriptor, are_ready},
        device::Gpu,
        formats::Formats,
    },
    volumes::{clip_pass::ClipPassUniform, layouts::bricks_layout, store::VolumeResources},
};

/// The passes, one for each kind of step.
pub(crate) struct FilteringPasses {
    densities: ComputePass,
    /// Filters of each quantity, along each of [`AXES`].
    filters: [[ComputePass; 3]; 3],
    /// Estimates for each kind of outcome.
    estimates: [ComputePass; 3],
    gradient: ComputePass,
}

/// The steps over one volume.
pub(crate) struct FilteringJob {
    volume: BindGroup,
    steps: Vec<(Step, BindGroup, u32)>,
}

impl FromWorld for FilteringPasses {
    fn from_world(world: &mut World) -> Self {
        let pass = |shader, shader_defs: &[ShaderDefVal], more: &[BindGroupLayoutEntryBuilder]| {
            let stages = ShaderStages::COMPUTE;
            let shared = BindGroupLayoutEntries::sequential(
                stages,
                (
                    texture_3d(TextureSampleType::Float { filterable: true }),
                    storage_buffer_read_only::<FilteringData>(false),
                    uniform_buffer::<ClipPassUniform>(false),
                ),
            );
            let more = (3..).zip(more).map(|(binding, entry)| entry.build(binding, stages));
            let own: Vec<_> = shared.iter().copied().chain(more).collect();
            let descriptor = PassDescriptor {
                name: "contextual_ao_filter",
                shader,
                shader_defs: shader_defs.to_vec(),
                before: vec![bricks_layout()],
                own: &own,
                ..default()
            };
            ComputePass::new(world, descriptor)
        };
        let read = storage_buffer_read_only_sized(false, None);
        let written = storage_buffer_sized(false, None);
        let stored = |format| texture_storage_3d(format, StorageTextureAccess::WriteOnly);
        let modulated = stored(TextureFormat::Rgba8Unorm);
        let means: Handle<Shader> = load_embedded_asset!(world, "means.wgsl");
        let extrema: Handle<Shader> = load_embedded_asset!(world, "extrema.wgsl");
        let filters = Quantity::ALL.map(|quantity| {
            [0, 1, 2].map(|turn| {
                let mut defs = vec![ShaderDefVal::UInt("AXIS".into(), AXES[turn])];
                if turn == 0 {
                    defs.push("OF_DENSITIES".into());
                }
                if quantity == Quantity::Square {
                    defs.push("SQUARES".into());
                }
                let shader = if quantity == Quantity::Extrema { &extrema } else { &means };
                pass(shader.clone(), &defs, &[read, written])
            })
        });
        let estimate: Handle<Shader> = load_embedded_asset!(world, "estimate.wgsl");
        let estimates = Outcome::ALL.map(|outcome| {
            let (def, target) = match outcome {
                Outcome::Factors => (None, stored(world.resource::<Formats>().scalar)),
                Outcome::Modulated => (Some("MODULATED"), modulated),
                Outcome::Shares => (Some("SHARES"), written),
            };
            let defs: Vec<_> = def.map(ShaderDefVal::from).into_iter().collect();
            pass(estimate.clone(), &defs, &[read, read, read, target])
        });
        Self {
            densities: pass(load_embedded_asset!(world, "densities.wgsl"), &[], &[written]),
            filters,
            estimates,
            gradient: pass(load_embedded_asset!(world, "gradient.wgsl"), &[], &[read, modulated]),
        }
    }
}

impl FilteringPasses {
    pub fn are_ready(&self, cache: &PipelineCache) -> bool {
        let filters = self.filters.iter().flatten();
        are_ready(filters.chain(&self.estimates).chain([&self.densities, &self.gradient]), cache)
    }

    fn pass(&self, step: Step) -> &ComputePass {
        match step {
            Step::Densities => &self.densities,
            Step::Filter { quantity, turn } => &self.filters[quantity as usize][turn],
            Step::Estimate(outcome) => &self.estimates[outcome as usize],
            Step::Gradient => &self.gradient,
        }
    }

    /// Writes the settings and binds the inputs and outputs of each step.
    pub fn bind_volume(
        &self,
        volume: &VolumeResources,
        filtering: &mut FilteringResources,
        group: &BindGroup,
        gpu: &Gpu,
    ) -> Option<FilteringJob> {
        filtering.data.write_buffer(&gpu.device, &gpu.queue);
        let shared = [
            BindingResource::TextureView(&volume.opacities.view),
            filtering.data.binding()?,
            volume.pass.binding()?,
        ];
        let steps = steps::steps(&filtering.settings).into_iter().map(|step| {
            let own = filtering.bindings(step, &volume.occlusion.view);
            let resources = (0..).zip(shared.iter().cloned().chain(own));
            let entries: Vec<_> =
                resources.map(|(binding, resource)| BindGroupEntry { binding, resource }).collect();
            let group = self.pass(step).bind_entries(&entries, &gpu.cache, &gpu.device);
            (step, group, step.invocations(filtering.dimensions))
        });
        Some(FilteringJob { volume: group.clone(), steps: steps.collect() })
    }

    pub fn encode_steps(&self, encoder: &mut CommandEncoder, job: &FilteringJob, cache: &PipelineCache) {
        for (step, group, invocations) in &job.steps {
            let groups = Groups::Invocations(*invocations);
            self.pass(*step).encode(encoder, [&job.volume, group], groups, cache);
        }
    }
}
