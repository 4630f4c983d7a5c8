//! Work of step IV on a volume in a frame, given the state of the volume's data on the GPU.

use bevy::{math::DVec3, prelude::*};

use super::{changes::Changes, cull_superbricks::SuperbrickBox};
use crate::{
    occlusion::Optimizations,
    render::{
        extract::ExtractedVolume,
        gpu::compute_pass::superbrick_counts,
        volumes::{
            carver_uniform::CarverUniform,
            clip_pass::{ClipPassUniform, Queue},
            contents::Contents,
            store::VolumeResources,
        },
    },
    volume::VolumeGeometry,
};

/// Demands of an occlusion method on clipping.
#[derive(Clone, Copy, Debug, Default)]
pub struct Demand {
    /// Stale voxels to be listed.
    pub(crate) queue: Queue,
    /// Whether all occlusion is stale, whatever changed.
    pub(crate) begins_anew: bool,
}

/// Work of step IV on a volume in a frame.
pub(crate) struct ClipStep {
    pub finds_ranges: bool,
    /// Carvers whose surroundings are clipped anew; `None` if nothing is clipped.
    pub changes: Option<Vec<CarverUniform>>,
    /// Superbricks around these carvers.
    pub superbricks: SuperbrickBox,
    /// Whether all voxels are stale, not only those near a change.
    pub is_all_stale: bool,
    /// Whether only the transfer function changed.
    pub changes_table_alone: bool,
    /// Whether only the settings of the occlusion method changed.
    pub changes_method_alone: bool,
    pub queue: Queue,
    pub pass: ClipPassUniform,
}

impl ClipStep {
    /// Whether occlusion may have changed.
    pub fn has_changes(&self) -> bool {
        self.changes.is_some()
    }
}

impl VolumeResources {
    /// Plans the clipping of this frame, and records it as done: a planned step always runs.
    pub fn clip_step(
        &mut self,
        volume: &ExtractedVolume,
        contents: Contents,
        demand: Demand,
        optimizations: &Optimizations,
    ) -> ClipStep {
        let state = &mut self.state;
        let recomputes_all = volume.recomputes_all;
        let Demand { queue, begins_anew } = demand;
        let queues_more = queue != Queue::None && queue != state.queue;
        let changes = if recomputes_all || queues_more || begins_anew {
            Changes::All
        } else {
            Changes::between(state.contents.as_ref(), &contents)
        };
        let is_all_stale = changes == Changes::All;
        let all_carvers = || contents.carvers.iter().map(|(carver, _)| *carver);
        let (changes, past, visits_all) = match changes {
            Changes::All => (Some(Vec::new()), 0, true),
            Changes::Carvers { past, present, keep_numbers } if !past.is_empty() || !present.is_empty() => {
                let count = past.len();
                (Some(past.into_iter().chain(present).collect()), count, !keep_numbers)
            }
            // As if all carvers had just come.
            _ if !optimizations.rest => (Some(all_carvers().collect::<Vec<_>>()), 0, true),
            _ => (None, 0, false),
        };
        let visits_all = visits_all || !optimizations.lists;
        let superbricks = superbricks_around(changes.iter().flatten(), visits_all, volume);
        state.clippings = state.clippings.wrapping_add(changes.is_some().into());
        let before = state.contents.as_ref().filter(|_| !recomputes_all);
        let changes_table_alone = before.is_some_and(|old| old.differs_in_table_alone(&contents));
        let changes_method_alone = before.is_some_and(|old| old.differs_in_method_alone(&contents));
        let pass = ClipPassUniform {
            first_superbrick: superbricks.first,
            clipping: state.clippings,
            end_superbrick: superbricks.end,
            visits_all: visits_all.into(),
            lists_all: (is_all_stale || !optimizations.lists).into(),
            is_all_stale: is_all_stale.into(),
            queue: queue as u32,
            changes: changes.as_ref().map_or(0, |changes| changes.len() as u32),
            past_changes: past as u32,
            coverage: contents.coverage as u32,
        };
        let stride = volume.occlusion.texels().stride();
        let step = ClipStep {
            finds_ranges: state.ranges_for != Some(stride),
            changes_table_alone,
            changes_method_alone,
            changes,
            superbricks,
            is_all_stale,
            queue,
            pass,
        };
        state.ranges_for = Some(stride);
        state.contents = Some(contents);
        state.queue = queue;
        step
    }
}

/// The superbricks in which changed carvers may matter: all of them if they say so, or if a carver acts everywhere.
fn superbricks_around<'a>(
    changes: impl Iterator<Item = &'a CarverUniform> + Clone,
    all: bool,
    volume: &ExtractedVolume,
) -> SuperbrickBox {
    let geometry = &volume.geometry;
    let counts = superbrick_counts(geometry.dimensions);
    let everything = SuperbrickBox { first: UVec3::ZERO, end: counts };
    // A brick's carvers are found by a ball around the brick.
    let near_mm = volume.footprint_mm() + 2.01 * geometry.cell_diagonal_mm();
    let radius_mm = volume.occlusion.reach_mm(geometry).max(near_mm);
    let Some(boxes) = outlines(changes, radius_mm, geometry).filter(|_| !all) else {
        return everything;
    };
    let voxel_from_local = geometry.local_from_voxel.inverse();
    let corners =
        boxes.into_iter().flatten().map(|corner| voxel_from_local.transform_point3(corner.as_dvec3()));
    let Some((low, high)) =
        corners.map(|corner| (corner, corner)).reduce(|(a, b), (c, d)| (a.min(c), b.max(d)))
    else {
        return SuperbrickBox::default();
    };
    // Casts of negative numbers give 0.
    let superbrick = |voxel: DVec3| (voxel / 16.0).floor().as_uvec3();
    SuperbrickBox {
        first: superbrick(low),
        end: superbrick(high.max(DVec3::splat(-16.0)) + 16.0).min(counts),
    }
}

/// Boxes around changed carvers that contain all points within a radius of their changes; `None` if that is everywhere.
pub(crate) fn outlines<'a>(
    changes: impl IntoIterator<Item = &'a CarverUniform>,
    radius_mm: f64,
    geometry: &VolumeGeometry,
) -> Option<Vec<[Vec3; 8]>> {
    // A point reads voxels that are up to a cell's diagonal away. Another diagonal covers rounding.
    let radius_mm = radius_mm + 2.0 * geometry.cell_diagonal_mm();
    changes.into_iter().map(|carver| carver.outline(radius_mm as f32)).collect()
}
