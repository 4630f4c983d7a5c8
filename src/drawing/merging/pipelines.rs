//! Pipelines of volumes that share space, for one kind of view. Volumes are drawn one after the other until all are compiled.

use bevy::{
    ecs::system::SystemParam,
    pbr::MeshPipelineKey,
    prelude::*,
    render::render_resource::{
        CachedRenderPipelineId, PipelineCache, SpecializedComputePipelines, SpecializedRenderPipelines,
    },
};

use super::{dimming::DimmingPipeline, transmittance::TransmittancePipeline};
use crate::drawing::pipeline::{DrawPipeline, DrawVariant};

/// Makes the pipelines.
#[derive(SystemParam)]
pub(in crate::drawing) struct MergingPipelines<'w> {
    dimming: Res<'w, DimmingPipeline>,
    dimmed: ResMut<'w, SpecializedRenderPipelines<DimmingPipeline>>,
    transmittance: Res<'w, TransmittancePipeline>,
    found: ResMut<'w, SpecializedComputePipelines<TransmittancePipeline>>,
}

/// Pipelines of a volume that shares space.
#[derive(Clone, Copy)]
pub(in crate::drawing) struct MergedPipelines {
    pub dims: CachedRenderPipelineId,
    pub draws: CachedRenderPipelineId,
    /// Draws the rays that `draws` leaves out.
    pub draws_cut_off: Option<CachedRenderPipelineId>,
    /// Draws samples at the outlines of meshes, in multisampled views with a depth prepass.
    pub draws_far: Option<CachedRenderPipelineId>,
}

impl MergingPipelines<'_> {
    /// Pipelines for a volume of a variant. `None` until all are compiled; from now on they are wanted.
    pub fn of(
        &mut self,
        view: MeshPipelineKey,
        variant: DrawVariant,
        (base, drawn): (&DrawPipeline, &mut SpecializedRenderPipelines<DrawPipeline>),
        cache: &PipelineCache,
    ) -> Option<MergedPipelines> {
        let mut finds = |of_outlines| {
            let key = (variant.of_transmittance(), of_outlines);
            let pipeline = self.found.specialize(cache, &self.transmittance, key);
            cache.get_compute_pipeline(pipeline).is_some()
        };
        let are_found = finds(false) & (view.msaa_samples() == 1 || variant.is_surface() || finds(true));
        let merged = variant.merged();
        let mut of = |variant| drawn.specialize(cache, base, (view, variant));
        let pipelines = MergedPipelines {
            dims: self.dimmed.specialize(cache, &self.dimming, view),
            draws: of(merged),
            draws_cut_off: merged.of_the_others().map(&mut of),
            draws_far: merged.of_far_samples(view).map(&mut of),
        };
        let others = pipelines.draws_cut_off.into_iter().chain(pipelines.draws_far);
        let rendered = [pipelines.dims, pipelines.draws].into_iter().chain(others);
        let are_there = rendered.fold(are_found, |all, id| all & cache.get_render_pipeline(id).is_some());
        are_there.then_some(pipelines)
    }
}
