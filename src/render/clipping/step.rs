//! Work of step IV on a volume in a frame, given the state of the volume's data on the GPU.

use bevy::prelude::*;

use super::changes::Changes;
use crate::{
    occlusion::Optimizations,
    render::{
        extract::ExtractedVolume,
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
    /// Whether all voxels are stale as soon as one voxel is.
    pub(crate) restarts: bool,
}

/// Work of step IV on a volume in a frame.
pub(crate) struct ClipStep {
    pub finds_ranges: bool,
    /// Carvers whose surroundings are clipped anew; `None` if nothing is clipped.
    pub changes: Option<Vec<CarverUniform>>,
    /// Whether all voxels are stale, not only those near a change.
    pub is_all_stale: bool,
    /// Whether only the transfer function changed.
    pub changes_table_alone: bool,
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
        let Demand { queue, restarts } = demand;
        let queues_more = queue != Queue::None && queue != state.queue;
        let changes = if recomputes_all || queues_more {
            Changes::All
        } else {
            match Changes::between(state.contents.as_ref(), &contents) {
                Changes::Carvers { past, present } if restarts && past.len() + present.len() > 0 => {
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
            // As if all carvers had just come.
            _ if !optimizations.rest => (Some(all_carvers().collect::<Vec<_>>()), 0),
            _ => (None, 0),
        };
        let differs_in_table_alone = |old: &Contents| old.differs_in_table_alone(&contents);
        let pass = ClipPassUniform {
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
            changes_table_alone: !recomputes_all
                && state.contents.as_ref().is_some_and(differs_in_table_alone),
            changes,
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

/// Boxes around changed carvers that contain all points within a radius of their changes; `None` if that is everywhere.
pub(crate) fn outlines(
    changes: &[CarverUniform],
    radius_mm: f64,
    geometry: &VolumeGeometry,
) -> Option<Vec<[Vec3; 8]>> {
    // A point reads voxels that are up to a cell's diagonal away. Another diagonal covers rounding.
    let radius_mm = radius_mm + 2.0 * geometry.cell_diagonal_mm();
    changes.iter().map(|carver| carver.outline(radius_mm as f32)).collect()
}
