//! Plan of a frame: the voxels to mark, and the rays to cast.

use bevy::render::render_resource::BindGroup;
use core::ops::Range;

use super::{
    Rays,
    cast::RayCastJob,
    kept::{KeptRays, RayPassUniform, RayProgress},
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
    pub(super) share: ShareJob,
    pub(super) cast: RayCastJob,
}

/// Settings of progressive rays, if the volume uses them in this frame.
fn progressive(volume: &ExtractedVolume) -> Option<ProgressiveRays> {
    let settings = volume.occlusion.method.get().copied();
    settings.filter(|_| volume.shading.ambient_occlusion && !volume.recomputes_all)
}

/// Demand on clipping: the voxels to list, none if views are followed.
pub(super) fn demand(volume: &ExtractedVolume, optimizations: &Optimizations) -> Demand {
    // A change restarts the progressive rays of all voxels.
    let restarts = progressive(volume).is_some();
    let queue = if !volume.shading.ambient_occlusion {
        Queue::None
    } else if volume.recomputes_all {
        Queue::All
    } else if optimizations.demand && !restarts {
        Queue::None
    } else if optimizations.sampleable {
        Queue::Sampleable
    } else {
        Queue::Visible
    };
    Demand { queue, restarts }
}

impl Rays {
    /// Decides which rays are cast, and records them as cast: a planned cast always runs.
    pub(super) fn plan_frame(&self, kept: &mut KeptRays, frame: &VolumeFrame, gpu: &Gpu) -> Option<RaysJob> {
        let VolumeFrame { of: KeptVolume { volume, resources }, step, windows, optimizations, .. } = *frame;
        kept.waiting.receive(gpu);
        let follows_views = frame.uses_occlusion() && step.queue == Queue::None;
        let views = if follows_views { windows } else { &[] };
        let unmarked = unmarked(views, &kept.marked, frame);
        let marks_any = unmarked.iter().any(Option::is_some);
        kept.marked = views.iter().map(|view| view.uniform).collect();

        let rays = kept.rays.get();
        let all_rays = (rays.len() / ENTRIES) as u32;
        let progressive = progressive(volume);
        let (cast, kept_share) = match progressive {
            Some(settings) => rays_of_frame(settings, kept.progress, step.is_all_stale, all_rays),
            None => (0..all_rays, 0.0),
        };
        let cast_weight: f32 = cast.clone().map(|ray| rays[ENTRIES * ray as usize].w).sum();
        let found_weight = kept.progress.weight * kept_share + cast_weight;
        kept.progress = RayProgress { rays: cast.end, weight: found_weight };
        let continues = progressive.is_some() && step.queue != Queue::None && !cast.is_empty();
        let lists_stale = step.has_changes() && step.queue != Queue::None;
        // Only words that views ask for may wait.
        let budget = frame.cast_budget.words_per_frame.filter(|_| step.queue == Queue::None);
        let begins_anew = step.has_changes() && step.is_all_stale;
        if begins_anew {
            BrickResources::empty(&resources.bricks.word_list, &gpu.queue);
            // The list's first word is the next one, also if nothing is cast in this frame.
            if let Some(state) = &kept.state {
                gpu.queue.write_buffer(state, 0, &[0; 4]);
            }
            kept.waiting.any = false;
        }
        if !marks_any && !lists_stale && !continues && !kept.waiting.any {
            return None;
        }
        let slices = Slices::of(resources.bricks.bricks * MASK_WORDS, frame.cast_budget.words_per_dispatch);
        kept.keep_state(slices, &gpu.device);
        let reads_back = kept.waiting.begin_cast(marks_any || lists_stale, budget.is_none(), gpu);

        let pass = RayPassUniform {
            first_ray: cast.start,
            end_ray: cast.end,
            steps: volume.occlusion.method.rays()?.steps,
            ends_early: optimizations.early_end.into(),
            leaps: optimizations.leaps.into(),
            kept: kept_share,
            found_weight,
            goes_on: (continues && cast.end < all_rays).into(),
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

/// Rays that a frame casts, and the share of the earlier rays' weight that counts. A change restarts at the first
/// ray.
fn rays_of_frame(
    settings: ProgressiveRays,
    before: RayProgress,
    has_changed: bool,
    all_rays: u32,
) -> (Range<u32>, f32) {
    let (first, kept) = if has_changed { (0, settings.kept_on_change) } else { (before.rays, 1.0) };
    (first..first.saturating_add(settings.rays_per_frame).min(all_rays), kept)
}
