//! What one volume needs this frame, given what is on the device for it.

use bevy::prelude::*;
use core::ops::Range;

use super::{changes::Changes, views::VolumeView};
use crate::{
    occlusion::{OcclusionMethod, ProgressiveRays, Shortcuts},
    render::{
        extract::ExtractedVolume,
        volumes::{
            carver_uniform::CarverUniform,
            pass_uniforms::{OcclusionPassUniform, Queue, WindowUniform},
            volume_state::{Computed, Contents, RayProgress},
            volume_store::VolumeResources,
        },
    },
};

/// What has to be done.
pub(super) struct Work {
    pub finds_ranges: bool,
    /// Carvers whose surroundings are clipped anew; `None` where nothing is.
    pub changes: Option<Vec<CarverUniform>>,
    /// Views to be followed.
    pub windows: Vec<WindowUniform>,
    pub casts: bool,
    /// Whether more rays of the same voxels are to be cast in the next frame.
    pub goes_on: bool,
    /// What a method that computes all voxels has to compute.
    pub computes: Computed,
    pub pass: OcclusionPassUniform,
}

impl Work {
    pub fn is_some(&self) -> bool {
        self.finds_ranges || self.changes.is_some() || self.casts || self.computes != Computed::Nothing
    }
}

impl VolumeResources {
    /// Decides this frame's passes, and records their outcome: once planned, they run.
    ///
    /// `views` are those of the volume, and `looks_different` says whether anything else changed
    /// by which they are drawn.
    pub(super) fn advance(
        &mut self,
        volume: &ExtractedVolume,
        contents: Contents,
        views: &[VolumeView],
        looks_different: bool,
        shortcuts: &Shortcuts,
    ) -> Work {
        let state = &mut self.state;
        let mode = volume.shading.mode;
        let method = volume.occlusion.method;
        let progressive = match method {
            OcclusionMethod::Progressive(settings)
                if mode.uses_occlusion() && !mode.recomputes_all() && self.ray_sums.is_some() =>
            {
                Some(settings)
            }
            _ => None,
        };
        let queue = if !mode.uses_occlusion() || !method.casts_rays() {
            Queue::None
        } else if mode.recomputes_all() {
            Queue::All
        } else if shortcuts.demand && progressive.is_none() {
            Queue::None
        } else if shortcuts.sampleable {
            Queue::Sampleable
        } else {
            Queue::Visible
        };
        let queues_more = queue != Queue::None && queue != state.queue;
        let changes = if mode.recomputes_all() || queues_more {
            Changes::All
        } else {
            match Changes::between(state.contents.as_ref(), &contents) {
                // All rays begin anew.
                Changes::Carvers { past, present }
                    if progressive.is_some() && past.len() + present.len() > 0 =>
                {
                    Changes::All
                }
                changes => changes,
            }
        };
        let is_all_stale = changes == Changes::All;
        let all_carvers = || contents.carvers.iter().map(|(carver, _)| *carver);
        let (changes, past) = match changes {
            Changes::All => (Some(Vec::new()), 0),
            Changes::Carvers { past, present } if !past.is_empty() || !present.is_empty() => {
                let count = past.len();
                (Some(past.into_iter().chain(present).collect()), count)
            }
            // As if all had just come.
            _ if !shortcuts.rest => (Some(all_carvers().collect::<Vec<_>>()), 0),
            _ => (None, 0),
        };
        let follows_views = mode.uses_occlusion() && method.casts_rays() && queue == Queue::None;
        // What a view reads that it has read before can differ only where one of the changes shows.
        let few = changes.as_ref().filter(|_| shortcuts.outlines && !is_all_stale);
        let outlines = few.and_then(|changes| outlines(changes, volume));
        let unread = |view: &VolumeView| {
            let is_new = looks_different || !state.marked.contains(&view.uniform);
            match &outlines {
                Some(outlines) if !is_new => view.around(outlines),
                _ => (is_new || changes.is_some() || !shortcuts.rest).then_some(view.uniform),
            }
        };
        let unmarked: Vec<_> = views.iter().filter(|_| follows_views).filter_map(unread).collect();
        let rays = self.rays.get();
        let all_rays = rays.len() as u32 / 2;
        let (cast, kept) = match progressive {
            Some(settings) => rays_of_frame(settings, state.progress, is_all_stale, all_rays),
            None => (0..all_rays, 0.0),
        };
        let cast_weight: f32 = cast.clone().map(|ray| rays[2 * ray as usize].w).sum();
        let found_weight = state.progress.weight * kept + cast_weight;
        let continues = progressive.is_some() && queue != Queue::None && !cast.is_empty();
        let draws_isosurface = self.sweeping.as_ref().is_some_and(|sweeping| sweeping.surface.is_some());
        let needed = if mode.uses_occlusion() && !method.casts_rays() && method.is_of_voxels() {
            Computed::Occlusion
        } else if draws_isosurface {
            Computed::Distances
        } else {
            Computed::Nothing
        };
        // Neither a surface at an isovalue nor what it occludes depends on the transfer function.
        let keeps_surface = self.sweeping.as_ref().is_some_and(|sweeping| sweeping.distances.is_some())
            && !mode.recomputes_all()
            && state.contents.as_ref().is_some_and(|old| old.differs_in_table_alone(&contents));
        let is_stale = changes.is_some() && !keeps_surface;
        let before = if is_stale { Computed::Nothing } else { state.computed };
        let computes = if needed > before { needed } else { Computed::Nothing };
        let pass = OcclusionPassUniform {
            lists_all: (is_all_stale || !shortcuts.lists).into(),
            is_all_stale: is_all_stale.into(),
            queue: queue as u32,
            changes: changes.as_ref().map_or(0, |changes| changes.len() as u32),
            past_changes: past as u32,
            coverage: contents.coverage as u32,
            first_ray: cast.start,
            end_ray: cast.end,
            steps: volume.occlusion.steps,
            ends_early: shortcuts.early_end.into(),
            leaps: shortcuts.leaps.into(),
            kept,
            found_weight,
        };
        let work = Work {
            finds_ranges: state.ranges_for != Some(volume.occlusion.resolution),
            casts: !unmarked.is_empty() || changes.is_some() && queue != Queue::None || continues,
            goes_on: continues && cast.end < all_rays,
            computes,
            changes,
            windows: unmarked,
            pass,
        };
        state.ranges_for = Some(volume.occlusion.resolution);
        state.computed = before.max(computes);
        state.progress = RayProgress { rays: cast.end, weight: found_weight };
        state.contents = Some(contents);
        state.queue = queue;
        let marked = views.iter().filter(|_| follows_views).map(|view| view.uniform);
        state.marked = marked.collect();
        work
    }
}

/// Which of all rays a frame casts, and what part of the weight of those before counts; after a change it begins
/// anew.
fn rays_of_frame(
    settings: ProgressiveRays,
    before: RayProgress,
    has_changed: bool,
    all_rays: u32,
) -> (Range<u32>, f32) {
    let (first, kept) = if has_changed { (0, settings.kept_on_change) } else { (before.rays, 1.0) };
    (first..first.saturating_add(settings.rays_per_frame).min(all_rays), kept)
}

/// Where carvers that changed may show, as boxes; `None` if that is everywhere.
fn outlines(changes: &[CarverUniform], volume: &ExtractedVolume) -> Option<Vec<[Vec3; 8]>> {
    // A point reads voxels that are up to a cell's diagonal away; another for rounding.
    let geometry = &volume.geometry;
    let radius_mm = volume.occlusion.reach_mm(geometry) + 2.0 * geometry.cell_diagonal_mm();
    changes.iter().map(|carver| carver.outline(radius_mm as f32)).collect()
}
