//! Bound passes of step IV over one volume.

use bevy::render::{
    render_resource::{BindGroup, Buffer, CommandEncoder},
    renderer::{RenderDevice, RenderQueue},
};

use super::{distances::DistanceGroups, passes::ClippingPasses, step::ClipStep};
use crate::render::{
    gpu::uniforms::write_if_changed,
    volumes::{
        bricks::{BrickResources, PENDING, work_group},
        carver_uniform::CarverUniform,
        store::{VolumeGroups, VolumeResources},
    },
};

/// The passes over one volume.
pub(crate) struct ClipJob {
    pub groups: VolumeGroups,
    /// Number of bricks.
    pub bricks: u32,
    /// Bind group that finds ranges, for a new volume or another stride of the occlusion.
    pub ranges: Option<BindGroup>,
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
    pub cull: BindGroup,
    /// The list of bricks that `cull` fills.
    pub bricks: BindGroup,
    pub clip: BindGroup,
    pub brick_list: Buffer,
    /// The list of voxels to be cast.
    pub words: BindGroup,
    pub distances: DistanceGroups,
}

impl CarveJob {
    /// Forgets voxels whose rays were still to be cast, because the list begins anew.
    pub fn forget_pending(&self, encoder: &mut CommandEncoder) {
        let (first, size) = self.pending;
        encoder.clear_buffer(&self.voxel_masks, first, Some(size));
    }
}

impl ClippingPasses<'_> {
    /// Writes the inputs of the passes and makes their bind groups. `None` if there is nothing to do.
    pub fn bind(
        &self,
        step: &ClipStep,
        volume: &mut VolumeResources,
        groups: &VolumeGroups,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) -> Option<ClipJob> {
        write_if_changed(&mut volume.pass, step.pass, device, queue);
        if !step.finds_ranges && step.changes.is_none() {
            return None;
        }
        let changes = step.changes.clone();
        let carve = match changes {
            Some(changes) => Some(self.bind_carve(changes, step.is_all_stale, volume, device, queue)?),
            None => None,
        };
        Some(ClipJob {
            groups: groups.clone(),
            bricks: volume.bricks.bricks,
            ranges: step.finds_ranges.then(|| self.ranges.bind_volume(volume, &self.cache, device)),
            carve,
        })
    }

    fn bind_carve(
        &self,
        mut changes: Vec<CarverUniform>,
        begins_anew: bool,
        volume: &mut VolumeResources,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) -> Option<CarveJob> {
        let cache = &*self.cache;
        BrickResources::empty(&volume.bricks.word_list, queue);
        BrickResources::empty(&volume.bricks.brick_list, queue);
        // A binding cannot be empty.
        changes.push(CarverUniform::default());
        volume.changes.set(changes);
        volume.changes.write_buffer(device, queue);
        Some(CarveJob {
            voxel_masks: volume.bricks.voxel_masks.clone(),
            pending: volume.bricks.mask(PENDING),
            begins_anew,
            cull: self.cull.bind_volume(volume, cache, device)?,
            bricks: work_group(&volume.bricks, &volume.bricks.brick_list, cache, device),
            clip: self.clip.bind_volume(volume, cache, device)?,
            brick_list: volume.bricks.brick_list.clone(),
            words: work_group(&volume.bricks, &volume.bricks.word_list, cache, device),
            distances: self.distances.bind_volume(volume, cache, device),
        })
    }
}
