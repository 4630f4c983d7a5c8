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
    runs::{MarchedViewUniform, Stale, ViewRuns},
};
use crate::occlusion::Reconstruction;
use crate::render::{
    extract::ExtractedVolume,
    gpu::{
        compute_pass::{ComputePass, PassDescriptor, are_ready},
        device::Gpu,
    },
    volumes::{layouts::bricks_layout, store::VolumeGroups},
    windows::VolumeWindow,
};

/// What tells the pipelines that follow view rays apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MarchVariant {
    reconstruction: Reconstruction,
    /// Whether the transfer function follows the gradient.
    by_gradient: bool,
}

impl MarchVariant {
    pub fn of(volume: &ExtractedVolume) -> Self {
        Self { reconstruction: volume.shading.reconstruction, by_gradient: volume.by_gradient }
    }
}

/// Follows the view rays of a volume: passes of trilinear and tricubic opacities, each for functions of the intensity
/// alone and for functions of the gradient too.
#[derive(Resource)]
pub(crate) struct MarchPass([[ComputePass; 2]; 2]);

/// March of the views of one volume.
pub(crate) struct MarchJob {
    variant: MarchVariant,
    volume: BindGroup,
    views: BindGroup,
    parts: ViewParts,
}

impl FromWorld for MarchPass {
    fn from_world(world: &mut World) -> Self {
        let written = storage_buffer_sized(false, None);
        let views = uniform_buffer_sized(true, None);
        let own = BindGroupLayoutEntries::sequential(ShaderStages::COMPUTE, (views, written, written));
        let pass = |shader_defs: &[&'static str]| {
            let descriptor = PassDescriptor {
                name: "contextual_ao_march",
                shader: load_embedded_asset!(world, "march.wgsl"),
                shader_defs: shader_defs.iter().map(|&def| def.into()).collect(),
                before: vec![bricks_layout()],
                own: &own,
                ..default()
            };
            ComputePass::new(world, descriptor)
        };
        Self([[pass(&[]), pass(&["BY_GRADIENT"])], [pass(&["TRICUBIC"]), pass(&["TRICUBIC", "BY_GRADIENT"])]])
    }
}

impl MarchPass {
    /// Whether the pipelines of all variants are compiled.
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        are_ready(self.0.iter().flatten(), cache)
    }

    fn of(&self, variant: MarchVariant) -> &ComputePass {
        let is_tricubic = variant.reconstruction == Reconstruction::Tricubic;
        &self.0[usize::from(is_tricubic)][usize::from(variant.by_gradient)]
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
        Some(MarchJob { variant, volume: groups.bricks.clone(), views, parts })
    }

    fn bind_runs(&self, runs: &mut ViewRuns, gpu: &Gpu) -> Option<BindGroup> {
        let ViewRuns { views, runs, further_runs, group, .. } = runs;
        let buffers = [views.buffer()?, runs.as_ref()?, further_runs.as_ref()?];
        Some(group.of(buffers.map(|buffer| buffer.id()), || {
            let [views, runs, further] = buffers;
            let views = ViewArray::<MarchedViewUniform>::binding(views, VIEWS_AT_ONCE);
            let resources = (views, runs.as_entire_binding(), further.as_entire_binding());
            self.0[0][0].bind(resources, &gpu.cache, &gpu.device)
        }))
    }

    /// Encodes the pass over all views.
    pub fn encode_views(&self, encoder: &mut CommandEncoder, job: &MarchJob, cache: &PipelineCache) {
        let groups = [&job.volume, &job.views];
        let pass = self.of(job.variant);
        encode_views(pass, encoder, &groups, &[ViewArray::<MarchedViewUniform>::BYTES], job.parts, cache);
    }
}
