//! Bound passes of step IV over one volume.

use bevy::{
    prelude::*,
    render::{
        render_resource::{BindGroup, Buffer, BufferId, CommandEncoder},
        renderer::{RenderDevice, RenderQueue},
        sync_world::MainEntity,
    },
};

use super::{
    cull_superbricks::SuperbrickBox, distances::DistanceGroups, passes::ClippingPasses,
    static_distances::StaticDistanceGroups, step::ClipStep,
};
use crate::render::{
    gpu::{
        kept_group::KeptGroup,
        uniforms::{BuffersOf, write_if_changed},
    },
    volumes::{
        bricks::{BrickResources, PENDING, work_group},
        carver_uniform::CarverUniform,
        store::{VolumeGroups, VolumeResources},
    },
};

/// The passes over one volume.
pub(crate) struct ClipJob {
    pub volume: VolumeGroups,
    /// Number of bricks.
    pub bricks: u32,
    /// Whether the ranges of bricks are found, for a new volume or another stride of the occlusion.
    pub finds_ranges: bool,
    pub groups: ClipGroups,
    /// Passes that clip, if carvers or anything else changed.
    pub carve: Option<CarveJob>,
}

/// Passes that find the changed bricks and clip them.
pub(crate) struct CarveJob {
    voxel_masks: Buffer,
    /// First byte and size of the mask of pending voxels.
    pending: (u64, u64),
    /// Whether all voxels are stale. Only then may voxels be pending from frames before.
    pub begins_anew: bool,
    /// Superbricks that may have changed, and the box around them in which distances may have.
    pub superbricks: [SuperbrickBox; 2],
    /// The list of superbricks, and the list of bricks.
    pub superbrick_list: Buffer,
    pub brick_list: Buffer,
}

impl CarveJob {
    /// Forgets voxels whose rays were still to be cast, because the list begins anew.
    pub fn forget_pending(&self, encoder: &mut CommandEncoder) {
        let (first, size) = self.pending;
        encoder.clear_buffer(&self.voxel_masks, first, Some(size));
    }
}

/// Bind groups of the passes over one volume.
#[derive(Clone)]
pub(crate) struct ClipGroups {
    pub ranges: BindGroup,
    pub static_distances: StaticDistanceGroups,
    pub cull_superbricks: BindGroup,
    pub cull_bricks: BindGroup,
    pub clip: BindGroup,
    pub distances: DistanceGroups,
    /// The lists of superbricks, of bricks, and of voxels to be cast, each with the masks of voxels.
    pub superbricks: BindGroup,
    pub bricks: BindGroup,
    pub words: BindGroup,
}

/// The bind groups of all seen volumes.
#[derive(Resource, Default)]
pub(crate) struct KeptClipGroups(BuffersOf<MainEntity, KeptGroup<[BufferId; 2], Option<ClipGroups>>>);

impl KeptClipGroups {
    /// Begins a frame. Frees the groups of volumes that the previous frame did not show.
    pub fn begin_frame(&mut self) {
        self.0.begin_frame();
    }
}

impl ClippingPasses<'_> {
    /// Writes the inputs of the passes and binds them. `None` if there is nothing to do.
    pub fn bind(
        &self,
        step: &ClipStep,
        (entity, volume): (MainEntity, &mut VolumeResources),
        groups: &VolumeGroups,
        kept: &mut KeptClipGroups,
        (device, queue): (&RenderDevice, &RenderQueue),
    ) -> Option<ClipJob> {
        let kept = kept.0.of(entity);
        write_if_changed(&mut volume.pass, step.pass, device, queue);
        if !step.finds_ranges && step.changes.is_none() {
            return None;
        }
        if let Some(changes) = &step.changes {
            // A binding cannot be empty.
            volume.changes.set(changes.iter().copied().chain([CarverUniform::default()]).collect());
            volume.changes.write_buffer(device, queue);
            BrickResources::empty(&volume.bricks.superbrick_list, queue);
            BrickResources::empty(&volume.bricks.brick_list, queue);
        }
        let bricks = &volume.bricks;
        let buffers = [volume.changes.buffer()?, &bricks.brick_list];
        let carve = step.changes.is_some().then(|| CarveJob {
            voxel_masks: bricks.voxel_masks.clone(),
            pending: bricks.mask(PENDING),
            begins_anew: step.is_all_stale,
            superbricks: [step.superbricks, step.superbricks.widened(bricks.superbrick_counts)],
            superbrick_list: bricks.superbrick_list.clone(),
            brick_list: bricks.brick_list.clone(),
        });
        Some(ClipJob {
            volume: groups.clone(),
            bricks: bricks.bricks,
            finds_ranges: step.finds_ranges,
            groups: kept.of(buffers.map(|buffer| buffer.id()), || self.bind_volume(volume, device))?,
            carve,
        })
    }

    fn bind_volume(&self, volume: &VolumeResources, device: &RenderDevice) -> Option<ClipGroups> {
        let (bricks, cache) = (&volume.bricks, &*self.cache);
        Some(ClipGroups {
            ranges: self.ranges.bind_volume(volume, cache, device),
            static_distances: self.static_distances.bind_volume(volume, cache, device),
            cull_superbricks: self.cull_superbricks.bind_volume(volume, cache, device)?,
            cull_bricks: self.cull_bricks.bind_volume(volume, cache, device)?,
            clip: self.clip.bind_volume(volume, cache, device)?,
            distances: self.distances.bind_volume(volume, cache, device),
            superbricks: work_group(bricks, &bricks.superbrick_list, cache, device),
            bricks: work_group(bricks, &bricks.brick_list, cache, device),
            words: work_group(bricks, &bricks.word_list, cache, device),
        })
    }
}
