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
    gpu::{
        compute_pass::{ComputePass, PassDescriptor},
        device::Gpu,
    },
    volumes::{layouts::bricks_layout, store::VolumeGroups},
    windows::VolumeWindow,
};

/// Follows the view rays of a volume, with either filter.
#[derive(Resource)]
pub(crate) struct MarchPass {
    trilinear: ComputePass,
    tricubic: ComputePass,
}

/// March of the views of one volume.
pub(crate) struct MarchJob {
    reconstruction: Reconstruction,
    volume: BindGroup,
    views: BindGroup,
    parts: ViewParts,
}

impl FromWorld for MarchPass {
    fn from_world(world: &mut World) -> Self {
        let written = storage_buffer_sized(false, None);
        let views = uniform_buffer_sized(true, None);
        let own = BindGroupLayoutEntries::sequential(ShaderStages::COMPUTE, (views, written, written));
        let pass = |shader_def: Option<&'static str>| {
            let descriptor = PassDescriptor {
                name: "contextual_ao_march",
                shader: load_embedded_asset!(world, "march.wgsl"),
                shader_defs: shader_def.map(Into::into).into_iter().collect(),
                before: vec![bricks_layout()],
                own: &own,
                ..default()
            };
            ComputePass::new(world, descriptor)
        };
        Self { trilinear: pass(None), tricubic: pass(Some("TRICUBIC")) }
    }
}

impl MarchPass {
    /// Whether the pipelines of both filters are compiled.
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        self.trilinear.is_ready(cache) & self.tricubic.is_ready(cache)
    }

    fn by(&self, reconstruction: Reconstruction) -> &ComputePass {
        match reconstruction {
            Reconstruction::Trilinear | Reconstruction::SmoothColors => &self.trilinear,
            Reconstruction::Tricubic => &self.tricubic,
        }
    }

    /// Plans the march of a volume's views, and writes its inputs. `None` if all runs are as stored.
    pub fn plan(
        &self,
        reconstruction: Reconstruction,
        windows: &[VolumeWindow],
        runs: &mut ViewRuns,
        stale: &Stale,
        groups: &VolumeGroups,
        gpu: &Gpu,
    ) -> Option<MarchJob> {
        if !self.by(reconstruction).is_ready(&gpu.cache) {
            return None;
        }
        let parts = runs.plan(windows, stale, gpu)?;
        let views = self.bind_runs(runs, gpu)?;
        Some(MarchJob { reconstruction, volume: groups.bricks.clone(), views, parts })
    }

    fn bind_runs(&self, runs: &mut ViewRuns, gpu: &Gpu) -> Option<BindGroup> {
        let ViewRuns { views, runs, further_runs, group, .. } = runs;
        let buffers = [views.buffer()?, runs.as_ref()?, further_runs.as_ref()?];
        Some(group.of(buffers.map(|buffer| buffer.id()), || {
            let [views, runs, further] = buffers;
            let views = ViewArray::<MarchedViewUniform>::binding(views, VIEWS_AT_ONCE);
            let resources = (views, runs.as_entire_binding(), further.as_entire_binding());
            self.trilinear.bind(resources, &gpu.cache, &gpu.device)
        }))
    }

    /// Encodes the pass over all views.
    pub fn encode_views(&self, encoder: &mut CommandEncoder, job: &MarchJob, cache: &PipelineCache) {
        let groups = [&job.volume, &job.views];
        let pass = self.by(job.reconstruction);
        encode_views(pass, encoder, &groups, &[ViewArray::<MarchedViewUniform>::BYTES], job.parts, cache);
    }
}
