//! Step V of the CAO paper: local ambient occlusion by rays around voxels, cast where the occlusion is stale and
//! seen. Rays are cast all at once, or a few in every frame.
//!
//! `frame` (views to follow, rays to cast) → `mark` (the voxels that views read) →
//! `fill` (what may wait) → `go_on` (those whose rays go on) → `share` (among dispatches) → `cast`.

pub(in crate::render) mod cast;
mod fill;
mod filter_probe;
mod frame;
mod go_on;
pub(in crate::render) mod kept;
mod mark;
mod share;
mod slices;
mod table;
mod waiting;

use bevy::{
    asset::embedded_asset,
    prelude::*,
    render::{render_resource::PipelineCache, renderer::RenderDevice},
    shader::load_shader_library,
};

use super::{
    registry::VoxelMethodPlugin,
    voxel_method::{KeptVolume, VolumeFrame, VoxelMethod},
};
use crate::{
    diagnostics::COUNTERS,
    occlusion::{OcclusionMethod, OcclusionRays, Optimizations, ProgressiveRays},
    render::{
        clipping::step::Demand,
        extract::ExtractedScene,
        gpu::{device::Gpu, frame::Frame},
    },
};
use cast::RayCastPasses;
use fill::FillPass;
use filter_probe::FilterProbe;
use frame::RaysJob;
use go_on::GoOnPass;
use kept::KeptRays;
use mark::MarkPass;
use share::SharePass;

/// Adds the method.
pub(super) struct RaysPlugin;

impl Plugin for RaysPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "mark.wgsl");
        embedded_asset!(app, "fill.wgsl");
        load_shader_library!(app, "cast_state.wgsl");
        embedded_asset!(app, "filter_probe.wgsl");
        load_shader_library!(app, "running_mean.wgsl");
        embedded_asset!(app, "go_on.wgsl");
        embedded_asset!(app, "share.wgsl");
        embedded_asset!(app, "cast.wgsl");
        app.add_plugins(VoxelMethodPlugin::<Rays>::default());
    }
}

/// The passes of the method.
pub(super) struct Rays {
    mark: MarkPass,
    fill: FillPass,
    go_on: GoOnPass,
    share: SharePass,
    probe: FilterProbe,
    cast: RayCastPasses,
    counts_work: bool,
}

impl FromWorld for Rays {
    fn from_world(world: &mut World) -> Self {
        Self {
            mark: MarkPass::from_world(world),
            fill: FillPass::from_world(world),
            go_on: GoOnPass::from_world(world),
            share: SharePass::from_world(world),
            probe: FilterProbe::from_world(world),
            cast: RayCastPasses::from_world(world),
            counts_work: false,
        }
    }
}

impl VoxelMethod for Rays {
    type Kept = KeptRays;
    type Job = RaysJob;

    fn computes(&self, method: &OcclusionMethod) -> bool {
        method.rays().is_some()
    }

    fn is_ready(&self, method: &OcclusionMethod, cache: &PipelineCache) -> bool {
        let is_progressive = method.get::<ProgressiveRays>().is_some();
        self.mark.is_ready(cache)
            & self.fill.is_ready(cache)
            & self.share.is_ready(cache)
            & self.probe.is_ready(cache)
            & self.cast.is_ready(self.counts_work, cache)
            & (!is_progressive || self.cast.progressive_is_ready(cache) & self.go_on.is_ready(cache))
    }

    fn read(&mut self, world: &World) {
        self.counts_work = world.resource::<ExtractedScene>().count_work;
        self.probe.begin_frame(world.resource::<RenderDevice>());
    }

    fn keep(&self, kept: Option<KeptRays>, volume: &KeptVolume, gpu: &Gpu) -> KeptRays {
        kept.unwrap_or_default().update(volume, gpu)
    }

    fn demand(&self, volume: &KeptVolume, optimizations: &Optimizations) -> Demand {
        frame::demand(volume, optimizations)
    }

    fn plan(&self, kept: &mut KeptRays, volume: &VolumeFrame, gpu: &Gpu) -> Option<RaysJob> {
        self.plan_frame(kept, volume, gpu)
    }

    fn encode(&self, jobs: &[RaysJob], frame: &mut Frame, cache: &PipelineCache) {
        if !jobs.is_empty() {
            self.probe.encode(frame.encoder(), cache);
        }
        if self.counts_work {
            frame.encoder().clear_buffer(&self.cast.work, 0, None);
        }
        let marks = jobs.iter().filter_map(|job| Some((job, job.mark.as_ref()?)));
        frame.pass(OcclusionRays::SPAN_MARK, marks, |encoder, (job, mark)| {
            self.mark.encode_views(encoder, &job.volume, mark, cache);
        });
        let slices = jobs.iter().flat_map(|job| (0..job.cast.slices).map(move |slice| (job, slice)));
        frame.pass_in_parts(
            OcclusionRays::SPAN_CAST,
            slices,
            |(_, slice)| *slice == 0,
            |encoder, (job, slice)| {
                if slice == 0 {
                    if let Some(fill) = &job.fill {
                        self.fill.encode_job(encoder, &job.volume, fill, cache);
                    }
                    if let Some(go_on) = &job.go_on {
                        self.go_on.encode_job(encoder, &job.volume, go_on, cache);
                    }
                    self.share.encode_job(encoder, &job.share, cache);
                }
                self.cast.encode(encoder, &job.volume, &job.cast, slice, cache);
            },
        );
        if self.counts_work {
            for (name, offset) in COUNTERS.into_iter().zip((0..).step_by(4)) {
                frame.record_word(name, &self.cast.work.slice(offset..offset + 4));
            }
        }
    }
}
