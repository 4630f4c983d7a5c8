//! The pass that follows the view rays of a volume, in all its views.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroup, BindGroupLayoutEntries, CommandEncoder, PipelineCache, ShaderStages,
        binding_types::{storage_buffer_sized, uniform_buffer_sized},
    },
};

use super::{
    dispatch::{VIEWS_AT_ONCE, ViewArray, ViewParts, encode_views},
    outlines::OutlinePass,
    runs::{MarchParts, MarchedViewUniform, Stale, ViewRuns},
};
use crate::occlusion::Reconstruction;
use crate::render::{
    gpu::{
        compute_pass::{ComputePass, PassDescriptor, are_ready},
        device::Gpu,
    },
    volumes::{contents::MarchVariant, layouts::bricks_layout, store::VolumeGroups},
    windows::VolumeWindow,
};

/// Follows the view rays of a volume: passes of trilinear and tricubic opacities, each for functions of the intensity
/// alone and for functions of the gradient too. Then follows the rays of outlines.
#[derive(Resource)]
pub(crate) struct MarchPass {
    march: [[ComputePass; 2]; 2],
    outlines: OutlinePass,
}

/// March of the views of one volume.
pub(crate) struct MarchJob {
    variant: MarchVariant,
    volume: BindGroup,
    views: BindGroup,
    /// Bind group for finding outlines.
    outlines: BindGroup,
    parts: MarchParts,
}

impl FromWorld for MarchPass {
    fn from_world(world: &mut World) -> Self {
        let written = storage_buffer_sized(false, None);
        let views = uniform_buffer_sized(true, None);
        let own =
            BindGroupLayoutEntries::sequential(ShaderStages::COMPUTE, (views, written, written, written));
        let pass = |reconstruction, by_gradient| {
            let variant = MarchVariant { reconstruction, by_gradient };
            let descriptor = PassDescriptor {
                name: "contextual_ao_march",
                shader: load_embedded_asset!(world, "march.wgsl"),
                shader_defs: variant.shader_defs().map(Into::into).collect(),
                before: vec![bricks_layout()],
                own: &own,
                ..default()
            };
            ComputePass::new(world, descriptor)
        };
        let passes = |reconstruction| [false, true].map(|by_gradient| pass(reconstruction, by_gradient));
        let march = [passes(Reconstruction::Trilinear), passes(Reconstruction::Tricubic)];
        Self { march, outlines: OutlinePass::from_world(world) }
    }
}

impl MarchPass {
    /// Whether the pipelines of all variants are compiled.
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        are_ready(self.march.iter().flatten().chain([&*self.outlines]), cache)
    }

    fn of(&self, variant: MarchVariant) -> &ComputePass {
        &self.march[usize::from(variant.reconstruction.is_tricubic())][usize::from(variant.by_gradient)]
    }

    /// Plans the march of a volume's views, and writes its inputs. `None` if all runs are as stored.
    pub fn plan(
        &self,
        variant: MarchVariant,
        windows: &[VolumeWindow],
        runs: &mut ViewRuns,
        stale: &Stale,
        groups: &VolumeGroups,
        gpu: &Gpu,
    ) -> Option<MarchJob> {
        if !self.of(variant).is_ready(&gpu.cache) {
            return None;
        }
        let parts = runs.plan(windows, stale, gpu)?;
        let views = self.bind_runs(runs, gpu)?;
        let outlines = self.outlines.bind_views(runs, gpu)?;
        Some(MarchJob { variant, volume: groups.bricks.clone(), views, outlines, parts })
    }

    fn bind_runs(&self, runs: &mut ViewRuns, gpu: &Gpu) -> Option<BindGroup> {
        let ViewRuns { views, runs, further_runs, outlines, group, .. } = runs;
        let buffers = [views.buffer()?, runs.as_ref()?, further_runs.as_ref()?, outlines.as_ref()?];
        Some(group.of(buffers.map(|buffer| buffer.id()), || {
            let [views, runs, further, outlines] = buffers;
            let views = ViewArray::<MarchedViewUniform>::binding(views, VIEWS_AT_ONCE);
            let [runs, further, outlines] =
                [runs, further, outlines].map(|buffer| buffer.as_entire_binding());
            let resources = (views, runs, further, outlines);
            self.march[0][0].bind(resources, &gpu.cache, &gpu.device)
        }))
    }

    /// Encodes the passes over all views.
    pub fn encode_views(&self, encoder: &mut CommandEncoder, job: &MarchJob, cache: &PipelineCache) {
        let bytes = [ViewArray::<MarchedViewUniform>::BYTES];
        let march = self.of(job.variant);
        let MarchParts { views, whole, outlines } = job.parts;
        encode_views(march, encoder, &[&job.volume, &job.views], &bytes, views, cache);
        if outlines > 0 {
            let all = ViewParts { largest: whole[0], ..views };
            encode_views(&self.outlines, encoder, &[&job.volume, &job.outlines], &bytes, all, cache);
            let rays = ViewParts { largest: whole[1], first: views.count, count: outlines };
            encode_views(march, encoder, &[&job.volume, &job.views], &bytes, rays, cache);
        }
    }
}
