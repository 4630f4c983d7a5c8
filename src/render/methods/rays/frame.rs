//! Plan of a frame: the voxels to mark, and the rays to cast.

use bevy::render::render_resource::BindGroup;

use super::{
    Rays,
    cast::RayCastJob,
    fill::FillJob,
    go_on::GoOnJob,
    kept::{KeptRays, RayPassUniform},
    mark::MarkJob,
    share::ShareJob,
    slices::Slices,
    table::ENTRIES,
};
use crate::{
    occlusion::{Optimizations, ProgressiveRays},
    render::{
        clipping::step::Demand,
        extract::ExtractedVolume,
        gpu::{device::Gpu, uniforms::write_if_changed},
        methods::voxel_method::{KeptVolume, VolumeFrame},
        views::runs::Stale,
        volumes::{
            bricks::{BrickResources, MASK_WORDS},
            clip_pass::Queue,
        },
        windows::{VolumeWindow, WindowUniform},
    },
};

/// The passes over one volume.
pub(in crate::render) struct RaysJob {
    pub(super) volume: BindGroup,
    /// Pass over the views that fills the list of voxels.
    pub(super) mark: Option<MarkJob>,
    /// Pass that gives what may wait a factor.
    pub(super) fill: Option<FillJob>,
    /// Pass that lists the voxels whose rays go on.
    pub(super) go_on: Option<GoOnJob>,
    pub(super) share: ShareJob,
    pub(super) cast: RayCastJob,
}

/// Settings of progressive rays, if the volume uses them in this frame.
fn progressive(volume: &ExtractedVolume) -> Option<ProgressiveRays> {
    let settings = volume.occlusion.method.get().copied();
    settings.filter(|_| volume.shading.ambient_occlusion && !volume.recomputes_all)
}

/// Demand on clipping: the voxels to list, none if views are followed.
pub(super) fn demand(of: &KeptVolume, optimizations: &Optimizations) -> Demand {
    let KeptVolume { volume, resources } = of;
    let queue = if !volume.shading.ambient_occlusion {
        Queue::None
    } else if volume.recomputes_all {
        Queue::All
    } else if optimizations.demand {
        Queue::None
    } else if optimizations.sampleable {
        Queue::Sampleable
    } else {
        Queue::Visible
    };
    let kept: Option<&KeptRays> = resources.kept.as_ref().and_then(|kept| kept.get());
    Demand { queue, begins_anew: kept.is_some_and(|kept| kept.means_are_new) }
}

impl Rays {
    /// Decides which rays are cast, and records them as cast: a planned cast always runs.
    pub(super) fn plan_frame(&self, kept: &mut KeptRays, frame: &VolumeFrame, gpu: &Gpu) -> Option<RaysJob> {
        let VolumeFrame { of: KeptVolume { volume, resources }, step, windows, optimizations, .. } = *frame;
        kept.waiting.begin_frame(frame.cast_pacing, frame.frame_ms, gpu);
        kept.means_are_new = false;
        let follows_views = frame.uses_occlusion() && step.queue == Queue::None;
        let views = if follows_views { windows } else { &[] };
        let unmarked = unmarked(views, &kept.marked, frame);
        let marks_any = unmarked.iter().any(Option::is_some);
        kept.marked = views.iter().map(|view| view.uniform).collect();

        let all_rays = (kept.rays.get().len() / ENTRIES) as u32;
        let progressive = progressive(volume);
        let count = progressive.map_or(all_rays, |settings| settings.rays_per_frame.min(all_rays));
        let lists_stale = step.has_changes() && step.queue != Queue::None;
        // Only words that views ask for may wait, and no progressive rays.
        let may_wait = step.queue == Queue::None && kept.running_means.is_none();
        let paces = may_wait && frame.cast_pacing.is_some();
        let bounds = [frame.cast_budget.words_per_frame, kept.waiting.paced.most()];
        let budget = bounds.into_iter().flatten().min().filter(|_| may_wait);
        let begins_anew = step.has_changes() && step.is_all_stale;
        if begins_anew {
            BrickResources::empty(&resources.bricks.word_list, &gpu.queue);
            // The list's first word is the next one, also if nothing is cast in this frame.
            if let Some(state) = &kept.state {
                gpu.queue.write_buffer(state, 0, &[0; 4]);
            }
            kept.waiting.any = false;
        }
        let goes_on = kept.frames_left > 0 && frame.uses_occlusion();
        let at_rest = !step.has_changes() && !kept.waiting.any;
        let fills = (budget.is_some() || paces) && frame.uses_occlusion() && kept.fill.is_due(frame, at_rest);
        if !marks_any && !lists_stale && !goes_on && !fills && !kept.waiting.any {
            return None;
        }
        if marks_any || lists_stale {
            kept.frames_left = all_rays.div_ceil(count.max(1));
        }
        kept.frames_left = kept.frames_left.saturating_sub(1);
        let first_ray = if progressive.is_some() { kept.next_ray % all_rays.max(1) } else { 0 };
        kept.next_ray = first_ray + count;
        let slices = Slices::of(resources.bricks.bricks * MASK_WORDS, frame.cast_budget.words_per_dispatch);
        kept.keep_state(slices, &gpu.device);
        let reads_back = kept.waiting.begin_cast(marks_any || lists_stale, budget.is_none(), paces, gpu);

        let pass = RayPassUniform {
            first_ray,
            end_ray: first_ray + count,
            all_rays,
            steps: volume.occlusion.method.rays()?.steps,
            ends_early: optimizations.early_end.into(),
            leaps: optimizations.leaps.into(),
            kept: progressive.map_or(0.0, |settings| settings.kept_on_change),
            words_per_slice: slices.words,
            words_per_frame: budget.unwrap_or(u32::MAX).max(1),
            slices: slices.count,
        };
        write_if_changed(&mut kept.pass, pass, &gpu.device, &gpu.queue);
        Some(RaysJob {
            volume: frame.group().clone(),
            mark: marks_any
                .then(|| self.mark.bind_views(&unmarked, self.probe.place_margin(), kept, frame, gpu))
                .flatten(),
            fill: fills.then(|| self.fill.bind_volume(&mut kept.fill, frame, gpu)).flatten(),
            go_on: goes_on.then(|| self.go_on.bind_volume(&resources.bricks, kept, gpu)).flatten(),
            share: self.share.bind_volume(&resources.bricks, kept, reads_back, gpu)?,
            cast: self.cast.bind_volume(resources, kept, self.counts_work, slices, gpu)?,
        })
    }
}

/// Part of each view that may read occlusion not read before.
fn unmarked(
    views: &[VolumeWindow],
    marked: &[WindowUniform],
    frame: &VolumeFrame,
) -> Vec<Option<WindowUniform>> {
    let VolumeFrame { of: KeptVolume { volume, .. }, step, optimizations, .. } = *frame;
    // Where a view was marked before, its reads can differ only as far as occlusion reaches from the changes.
    let reach_mm = volume.occlusion.reach_mm(&volume.geometry);
    let stale = Stale::by(step, reach_mm, &volume.geometry, optimizations);
    let is_new = |view: &VolumeWindow| frame.looks_different || !marked.contains(&view.uniform);
    views.iter().map(|view| stale.part_of(view, is_new(view))).collect()
}
