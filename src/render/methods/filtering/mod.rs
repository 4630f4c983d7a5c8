//! Volumetric ambient occlusion by filtering (Ruiz et al. 2010): the occlusion of all voxels from means and extrema of
//! the densities around them. Separable filters find these in a time independent of the radius. `steps` gives the
//! order of the passes, `passes` runs them, `resources` keeps their results.

mod passes;
mod resources;
mod steps;

use bevy::{
    asset::embedded_asset, prelude::*, render::render_resource::PipelineCache, shader::load_shader_library,
};

#[cfg(test)]
pub(in crate::render) use resources::FilteringData;

use super::{
    registry::VoxelMethodPlugin,
    voxel_method::{KeptVolume, VolumeFrame, VoxelMethod},
};
use crate::{
    occlusion::{OcclusionFiltering, OcclusionMethod},
    render::gpu::{device::Gpu, frame::Frame},
};
use passes::{FilteringJob, FilteringPasses};
use resources::FilteringResources;

/// Adds the method.
pub(super) struct FilteringPlugin;

impl Plugin for FilteringPlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "voxel_lines.wgsl");
        load_shader_library!(app, "voxel_density.wgsl");
        embedded_asset!(app, "densities.wgsl");
        embedded_asset!(app, "means.wgsl");
        embedded_asset!(app, "extrema.wgsl");
        embedded_asset!(app, "estimate.wgsl");
        embedded_asset!(app, "gradient.wgsl");
        app.add_plugins(VoxelMethodPlugin::<FilteringPasses>::default());
    }
}

impl VoxelMethod for FilteringPasses {
    type Kept = FilteringResources;
    type Job = FilteringJob;

    fn computes(&self, method: &OcclusionMethod) -> bool {
        method.get::<OcclusionFiltering>().is_some()
    }

    fn is_ready(&self, _: &OcclusionMethod, cache: &PipelineCache) -> bool {
        self.are_ready(cache)
    }

    fn keep(&self, kept: Option<FilteringResources>, volume: &KeptVolume, gpu: &Gpu) -> FilteringResources {
        let settings = volume.settings().copied().unwrap_or_default();
        FilteringResources::kept(kept, settings, volume.volume, volume.resources.range, &gpu.device)
    }

    fn plan(&self, kept: &mut FilteringResources, volume: &VolumeFrame, gpu: &Gpu) -> Option<FilteringJob> {
        kept.is_valid &= !volume.has_changed();
        if kept.is_valid || !volume.uses_occlusion() {
            return None;
        }
        let job = self.bind_volume(volume.resources, kept, volume.group(), gpu)?;
        kept.is_valid = true;
        Some(job)
    }

    fn encode(&self, jobs: &[FilteringJob], frame: &mut Frame, cache: &PipelineCache) {
        frame.pass(OcclusionFiltering::SPAN, jobs, |encoder, job| self.encode_steps(encoder, job, cache));
    }
}
