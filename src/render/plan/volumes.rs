//! Which passes each volume needs.

use bevy::{
    ecs::system::SystemParam,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, Buffer, CommandEncoder, ShaderType, UniformBuffer, encase::internal::WriteInto,
        },
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::{FramePlan, work::Work};
use crate::{
    diagnostics::{ReportChannel, SweepDistancesAlone},
    render::{
        carvers::{clip_maps::ClipMaps, clip_textures::ClipTextures},
        clipping::distances::DistanceGroups,
        extract::{ExtractedScene, ExtractedVolume},
        gpu::formats::Formats,
        methods::{
            filtering::FilteringJob,
            rays::{mark::MarkJob, ray_cast::RayCastJob},
            sweeping::{SweepJob, SweepResources},
        },
        passes::Passes,
        volumes::{
            brick_resources::{BrickResources, PENDING, work_group},
            carver_uniform::{CarverTable, CarverUniform},
            volume_bindings,
            volume_state::{Computed, Contents},
            volume_store::{VolumeResources, VolumeStore},
            volume_uniform::VolumeUniform,
        },
    },
};

/// The passes over one volume.
pub(crate) struct VolumeJob {
    /// Group 0 of passes that find out about bricks, and of those that go by it.
    pub volume_group: BindGroup,
    pub bricks_group: BindGroup,
    /// Number of bricks.
    pub bricks: u32,
    /// Once per volume.
    pub ranges: Option<BindGroup>,
    /// Step IV, where carvers or anything else changed.
    pub clip: Option<ClipJob>,
    /// Views to be followed, and the list that they fill.
    pub marks: Vec<MarkJob>,
    pub words: BindGroup,
    /// Step V, for what was put on the list.
    pub cast: Option<RayCastJob>,
    /// The same of all voxels, by sweeps.
    pub sweep: Option<SweepJob>,
    /// Occlusion by filtering.
    pub filter: Option<FilteringJob>,
}

/// Finds what changed and clips it.
pub(crate) struct ClipJob {
    voxel_masks: Buffer,
    /// First byte and size of the mask of pending voxels.
    pending: (u64, u64),
    pub cull: BindGroup,
    /// The list that it fills.
    pub listed: BindGroup,
    pub clip: BindGroup,
    pub brick_list: Buffer,
    pub distances: DistanceGroups,
}

/// The passes, and what their bind groups take.
#[derive(SystemParam)]
pub(crate) struct VolumePasses<'w> {
    passes: Passes<'w>,
    formats: Res<'w, Formats>,
    device: Res<'w, RenderDevice>,
    queue: Res<'w, RenderQueue>,
    distances_alone: Res<'w, SweepDistancesAlone>,
}

/// Writes what the shaders read and plans the passes over volumes.
pub(crate) fn plan_volumes(
    scene: Res<ExtractedScene>,
    volume_passes: VolumePasses,
    clip_maps: Res<ClipMaps>,
    report: Res<ReportChannel>,
    mut store: ResMut<VolumeStore>,
    mut plan: ResMut<FramePlan>,
) {
    plan.volumes.clear();
    plan.counts_work = scene.count_work;
    plan.times_by_clock = scene.time_by_clock;
    let Some(clip) = &clip_maps.textures else {
        return;
    };
    let mut progress = Vec::new();
    for volume in scene.volumes.iter().filter(|volume| volume.is_placed) {
        let Some(resources) = store.0.get_mut(&volume.entity) else {
            continue;
        };
        let are_ready = volume_passes.passes.are_ready_for(&volume.occlusion.method, scene.count_work);
        // Until all carvers carve, nothing is final.
        let is_final = are_ready && volume.has_occlusion && !volume.awaits_pipelines && !plan.carvers_wait;
        progress.push((volume.entity.id(), if is_final { 1.0 } else { 0.0 }));
        if !plan.sees(volume) {
            // Whatever changes meanwhile is found by comparison when it is seen again.
            continue;
        }
        let (device, queue) = (&*volume_passes.device, &*volume_passes.queue);
        resources.upload(volume, device, queue);
        let carvers = carvers_of(volume, &scene, &plan);
        let table: CarverTable = carvers.iter().map(|(carver, _)| *carver).collect();
        let sizes = [clip.depth_map_size, clip.dilation_map_size()];
        let largest = resources.gpu_volume.largest_stored;
        let drawn = resources.sweeping.as_ref().and_then(SweepResources::drawn_intensities);
        let shortcuts = &scene.shortcuts;
        let uniform = VolumeUniform::new(volume, largest, are_ready, drawn, sizes, carvers.len(), shortcuts);
        let looks_different = write_if_changed(&mut resources.uniform, uniform, device, queue);
        write_if_changed(&mut resources.carvers, table, device, queue);
        if !are_ready {
            continue;
        }
        let contents = Contents::of(volume, carvers, scene.clip_settings.coverage);
        let views = plan.views_of(volume.entity);
        let work = resources.advance(volume, contents, views, looks_different, shortcuts);
        if work.is_some() {
            plan.volumes.extend(work.bind(resources, clip, scene.count_work, &volume_passes));
        }
    }
    if let Ok(mut report) = report.0.lock() {
        report.progress = progress;
        report.layers_wanted = plan.layers_wanted;
        report.cut_off.clone_from(&plan.cut_off);
        report.usage = store.usage() + clip_maps.usage();
    }
}

/// The carvers that act on a volume, as its shaders see them, with the revision of their maps.
fn carvers_of(
    volume: &ExtractedVolume,
    scene: &ExtractedScene,
    plan: &FramePlan,
) -> Vec<(CarverUniform, u64)> {
    let carving = volume.carvers.iter().filter_map(|&(index, pose)| {
        let carver = &scene.carvers[index];
        let ready = plan.carvers.get(&carver.entity)?;
        Some((CarverUniform::new(carver, ready, volume, pose), ready.revision))
    });
    carving.collect()
}

/// Puts a value where shaders read it, unless it is there. Returns whether it was not.
fn write_if_changed<T: ShaderType + WriteInto + PartialEq>(
    buffer: &mut UniformBuffer<T>,
    value: T,
    device: &RenderDevice,
    queue: &RenderQueue,
) -> bool {
    let is_new = buffer.buffer().is_none() || *buffer.get() != value;
    if is_new {
        buffer.set(value);
        buffer.write_buffer(device, queue);
    }
    is_new
}

impl ClipJob {
    /// Forgets voxels whose rays were to go on being cast: the list begins anew.
    pub fn forget_pending(&self, encoder: &mut CommandEncoder) {
        let (first, size) = self.pending;
        encoder.clear_buffer(&self.voxel_masks, first, Some(size));
    }
}

impl Work {
    /// Writes what the passes read and makes their bind groups.
    fn bind(
        self,
        volume: &mut VolumeResources,
        clip: &ClipTextures,
        counts: bool,
        volume_passes: &VolumePasses,
    ) -> Option<VolumeJob> {
        let VolumePasses { passes, formats, device, queue, distances_alone } = volume_passes;
        let cache = &*passes.cache;
        volume.pass.set(self.pass);
        volume.pass.write_buffer(device, queue);
        // What goes on casting goes on with the same list.
        if self.changes.is_some() || volume.ray_sums.is_none() {
            BrickResources::empty(&volume.bricks.word_list, queue);
        }
        let clip_job = match self.changes {
            Some(mut changes) => {
                BrickResources::empty(&volume.bricks.brick_list, queue);
                // A binding cannot be empty.
                changes.push(default());
                volume.changes.set(changes);
                volume.changes.write_buffer(device, queue);
                Some(ClipJob {
                    voxel_masks: volume.bricks.voxel_masks.clone(),
                    pending: volume.bricks.mask(PENDING),
                    cull: passes.cull.bind_volume(volume, cache, device)?,
                    listed: work_group(&volume.bricks, &volume.bricks.brick_list, cache, device),
                    clip: passes.clip.bind_volume(volume, cache, device)?,
                    brick_list: volume.bricks.brick_list.clone(),
                    distances: passes.distances.bind_volume(volume, cache, device),
                })
            }
            None => None,
        };
        let filter = match self.computes {
            Computed::Nothing => None,
            _ => passes.filtering.bind_volume(volume, cache, device, queue),
        };
        let distances_alone = distances_alone.0 || self.computes == Computed::Distances;
        let sweep = match self.computes {
            Computed::Nothing => None,
            _ => passes.sweep.bind_volume(volume, distances_alone, cache, device, queue),
        };
        let [volume_group, bricks_group] =
            volume_bindings::compute_bind_groups(volume, clip, formats, cache, device)?;
        let marks = self.windows.into_iter();
        Some(VolumeJob {
            volume_group,
            bricks_group,
            bricks: volume.bricks.bricks,
            ranges: self.finds_ranges.then(|| passes.ranges.bind_volume(volume, cache, device)),
            clip: clip_job,
            marks: marks.filter_map(|window| passes.mark.bind_window(window, cache, device, queue)).collect(),
            words: work_group(&volume.bricks, &volume.bricks.word_list, cache, device),
            cast: if self.casts {
                passes.ray_cast.bind_volume(volume, formats, counts, self.goes_on, cache, device)
            } else {
                None
            },
            sweep,
            filter,
        })
    }
}
