//! What one volume needs this frame, given what its textures hold.

use bevy::prelude::*;

use super::budget::BudgetShare;
use crate::{
    clip::CoverageRule,
    render::{
        bricks::brick_count,
        extract::ExtractedVolume,
        volume_store::{OpacityKey, UnclippedKey, VolumeResources},
        volume_uniform::CarverUniform,
    },
};

/// What the textures of a volume should hold at the end of this frame.
pub(super) struct Goal {
    pub unclipped: UnclippedKey,
    pub opacities: OpacityKey,
    pub coverage: CoverageRule,
}

impl Goal {
    pub fn of(volume: &ExtractedVolume, carvers: Vec<(CarverUniform, u64)>, coverage: CoverageRule) -> Self {
        let unclipped =
            UnclippedKey { table_revision: volume.table.revision, occlusion: volume.occlusion.clone() };
        Self {
            opacities: OpacityKey::Clipped { unclipped: unclipped.clone(), carvers, coverage },
            unclipped,
            coverage,
        }
    }

    /// What the drawn occlusion is of, once it is computed.
    fn outcome(&self) -> (UnclippedKey, OpacityKey) {
        (self.unclipped.clone(), self.opacities.clone())
    }
}

/// What has to be done to come closer to a [`Goal`].
#[derive(Default)]
pub(super) struct Work {
    /// First brick and end of a portion of step I, and whether opacities come first.
    pub precompute: Option<(u32, u32, bool)>,
    pub classifies: bool,
    pub casts: bool,
    pub casts_all: bool,
    pub volume_bricks: u32,
    pub rays: u32,
    pub steps: u32,
    pub coverage: CoverageRule,
}

impl VolumeResources {
    /// Share of what the shading mode needs that is there after this frame.
    pub(super) fn progress(&self, goal: &Goal, volume: &ExtractedVolume) -> f32 {
        let mode = volume.shading.mode;
        let state = &self.state;
        let is_done = if mode.uses_occlusion() {
            state.occlusion_for.as_ref() == Some(&goal.outcome())
        } else {
            !mode.uses_light() || state.opacities_for.as_ref() == Some(&goal.opacities)
        };
        if is_done {
            return 1.0;
        }
        if state.unclipped_for.as_ref() != Some(&goal.unclipped) {
            return 0.0;
        }
        // Never quite 1 while the carvers have not been seen to.
        let bricks = brick_count(volume.geometry.dimensions) as f32;
        (state.bricks_done as f32 / bricks).min(0.999)
    }

    /// Decides this frame's passes, and records their outcome: once planned, they run.
    pub(super) fn advance(&mut self, volume: &ExtractedVolume, goal: &Goal, share: &mut BudgetShare) -> Work {
        let mode = volume.shading.mode;
        let state = &mut self.state;
        let mut work = Work {
            volume_bricks: brick_count(volume.geometry.dimensions),
            rays: volume.occlusion.pattern.rays(),
            steps: volume.occlusion.steps,
            casts_all: mode.recomputes_all(),
            coverage: goal.coverage,
            ..default()
        };
        if mode.uses_occlusion() && !work.casts_all {
            if state.unclipped_for.as_ref() != Some(&goal.unclipped) {
                state.unclipped_for = Some(goal.unclipped.clone());
                state.bricks_done = 0;
            }
            if state.bricks_done < work.volume_bricks {
                let per_voxel = work.rays as u64 * work.steps.max(1) as u64;
                let first = state.bricks_done;
                let end = first
                    .saturating_add(share.take(per_voxel, work.volume_bricks - first))
                    .min(work.volume_bricks);
                let unclipped = OpacityKey::Unclipped(goal.unclipped.clone());
                let classifies = state.opacities_for.as_ref() != Some(&unclipped);
                state.opacities_for = Some(unclipped);
                state.bricks_done = end;
                work.precompute = Some((first, end, classifies));
                if end < work.volume_bricks {
                    // Carving waits: the opacities are in use.
                    return work;
                }
            }
        }
        if work.casts_all {
            // The reference recomputes everything every frame.
            (work.classifies, work.casts) = (true, true);
        } else {
            work.classifies = (mode.uses_occlusion() || mode.uses_light())
                && state.opacities_for.as_ref() != Some(&goal.opacities);
            work.casts = mode.uses_occlusion() && state.occlusion_for.as_ref() != Some(&goal.outcome());
            // The categories are needed again where only the cast is missing.
            work.classifies |= work.casts;
        }
        if work.classifies {
            state.opacities_for = Some(goal.opacities.clone());
        }
        if work.casts {
            state.occlusion_for = Some(goal.outcome());
        }
        work
    }
}
