//! Which volumes need clipping or casting.

use bevy::{
    prelude::*,
    render::{
        render_resource::{BindGroup, PipelineCache},
        renderer::{RenderDevice, RenderQueue},
    },
};
use std::time::{Duration, Instant};

use super::FramePlan;
use crate::{
    diagnostics::ReportChannel,
    render::{
        bricks::{VOXELS_PER_BRICK, brick_count},
        classify::ClassifyPipeline,
        clip_maps::ClipMaps,
        extract::{ExtractedScene, ExtractedVolume},
        formats::Formats,
        ray_cast::{RayCastPipeline, RayCastTarget},
        volume_bindings,
        volume_store::{OpacityKey, UnclippedKey, VolumeResources, VolumeStore},
        volume_uniform::{CarverTable, CarverUniform, OcclusionPassUniform, VolumeUniform},
    },
};

/// The passes over one volume.
pub(crate) struct VolumeJob {
    /// Group 0 of all of them.
    pub volume_group: BindGroup,
    pub precompute: Option<PrecomputeJob>,
    pub carve: Option<CarveJob>,
}

/// A portion of step I.
pub(crate) struct PrecomputeJob {
    /// Unclipped opacities of the whole volume, where they are not there yet.
    pub classify: Option<BindGroup>,
    pub volume_bricks: u32,
    pub cast: BindGroup,
    pub bricks: u32,
}

/// Steps IV and V over the whole volume.
pub(crate) struct CarveJob {
    pub classify: BindGroup,
    pub cast: Option<BindGroup>,
    pub bricks: u32,
}

/// How many samples of step I are taken in one frame: as many as keep the app responsive.
///
/// One dispatch then also stays far below what a driver's watchdog allows (2 s on Windows).
pub(crate) struct PrecomputeBudget {
    samples: u64,
    last_frame: Option<Instant>,
    /// The shortest frame so far: about what a frame takes without computing occlusion.
    shortest: Duration,
}

impl Default for PrecomputeBudget {
    fn default() -> Self {
        Self {
            samples: Self::LEAST,
            last_frame: None,
            shortest: Duration::MAX,
        }
    }
}

impl PrecomputeBudget {
    const LEAST: u64 = 1 << 22;
    const MOST: u64 = 1 << 32;
    /// A frame may take this long for computing occlusion, or twice what it takes anyway.
    const FRAME: Duration = Duration::from_millis(50);
    /// But no longer than this.
    const LONGEST: Duration = Duration::from_secs(1);

    /// Bricks to cast this frame, at least one.
    fn bricks(&mut self, samples_per_voxel: u64, now: Instant) -> u32 {
        if let Some(last) = self.last_frame.replace(now) {
            let frame = now.duration_since(last);
            self.shortest = self.shortest.min(frame);
            let allowed = Self::FRAME.max(2 * self.shortest).min(Self::LONGEST);
            let samples = if frame < allowed {
                self.samples * 2
            } else {
                self.samples / 2
            };
            self.samples = samples.clamp(Self::LEAST, Self::MOST);
        }
        let per_brick = (samples_per_voxel * VOXELS_PER_BRICK).max(1);
        (self.samples / per_brick).clamp(1, u32::MAX as u64) as u32
    }

    /// To be called in frames that compute none: the time since then says nothing.
    fn pause(&mut self) {
        self.last_frame = None;
        self.shortest = Duration::MAX;
    }
}

/// Writes what the shaders read and plans steps I, IV and V.
pub(crate) fn plan_volumes(
    scene: Res<ExtractedScene>,
    classify: Res<ClassifyPipeline>,
    ray_cast: Res<RayCastPipeline>,
    formats: Res<Formats>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    clip_maps: Res<ClipMaps>,
    report: Res<ReportChannel>,
    mut store: ResMut<VolumeStore>,
    mut plan: ResMut<FramePlan>,
    mut budget: Local<PrecomputeBudget>,
) {
    plan.volumes.clear();
    plan.counts_work = scene.count_work;
    plan.times_by_clock = scene.time_by_clock;
    let Some(clip) = &clip_maps.textures else {
        return;
    };
    let pipelines_ready = classify.is_ready(&cache) && ray_cast.is_ready(&cache);
    let mut progress = Vec::new();
    let mut precomputes = false;
    for volume in &scene.volumes {
        let Some(resources) = store.0.get_mut(&volume.entity) else {
            continue;
        };
        resources.upload(volume, &device, &queue);
        let (carvers, carver_count) = carver_table(volume, &scene, &plan);
        let goal = Goal::of(volume, carvers, carver_count, plan.maps_revision);
        let work = if pipelines_ready {
            resources.advance(volume, &goal, &mut budget)
        } else {
            default()
        };
        precomputes |= work.precompute.is_some();
        progress.push((volume.entity.id(), resources.progress(&goal, volume)));
        resources.write_uniforms(
            volume,
            &goal,
            clip.depth_map_size,
            clip.dilation_map_size(),
            &device,
            &queue,
        );
        let job = work.bind(
            resources,
            clip,
            &formats,
            &classify,
            &ray_cast,
            scene.count_work,
            &cache,
            &device,
            &queue,
        );
        plan.volumes.extend(job);
    }
    if !precomputes {
        budget.pause();
    }
    if let Ok(mut report) = report.0.lock() {
        report.progress = progress;
        report.usage = store.usage();
        let maps = clip_maps.usage();
        report.usage.textures += maps.textures;
        report.usage.bytes += maps.bytes;
    }
}

/// The carvers that act on a volume, as its shaders see them.
fn carver_table(volume: &ExtractedVolume, scene: &ExtractedScene, plan: &FramePlan) -> (CarverTable, u32) {
    let mut table = CarverTable::default();
    let mut count = 0;
    for carver in &scene.carvers {
        let Some(ready) = plan.carvers.get(&carver.entity) else {
            continue;
        };
        if carver.clip_mesh.carves(volume.entity.id()) {
            table.carvers[count] = CarverUniform::new(carver, volume, ready.dilation.frame(), ready.slot);
            count += 1;
        }
    }
    (table, count as u32)
}

/// What the textures of a volume should hold at the end of this frame.
struct Goal {
    unclipped: UnclippedKey,
    opacities: OpacityKey,
    carvers: CarverTable,
    carver_count: u32,
}

impl Goal {
    fn of(volume: &ExtractedVolume, carvers: CarverTable, carver_count: u32, maps_revision: u64) -> Self {
        let unclipped = UnclippedKey {
            table_revision: volume.table.revision,
            occlusion: volume.occlusion.clone(),
        };
        Self {
            opacities: OpacityKey::Clipped {
                unclipped: unclipped.clone(),
                carvers: carvers.clone(),
                carver_count,
                maps_revision: if carver_count == 0 { 0 } else { maps_revision },
            },
            unclipped,
            carvers,
            carver_count,
        }
    }

    /// What the drawn occlusion is of, once it is computed.
    fn outcome(&self) -> (UnclippedKey, OpacityKey) {
        (self.unclipped.clone(), self.opacities.clone())
    }
}

/// What has to be done to come closer to a [`Goal`].
#[derive(Default)]
struct Work {
    /// First brick and end of a portion of step I, and whether opacities come first.
    precompute: Option<(u32, u32, bool)>,
    classifies: bool,
    casts: bool,
    casts_all: bool,
    volume_bricks: u32,
    rays: u32,
    steps: u32,
}

impl VolumeResources {
    /// Share of what the shading mode needs that is there after this frame.
    fn progress(&self, goal: &Goal, volume: &ExtractedVolume) -> f32 {
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
    fn advance(&mut self, volume: &ExtractedVolume, goal: &Goal, budget: &mut PrecomputeBudget) -> Work {
        let mode = volume.shading.mode;
        let state = &mut self.state;
        let mut work = Work {
            volume_bricks: brick_count(volume.geometry.dimensions),
            rays: volume.occlusion.pattern.rays(),
            steps: volume.occlusion.steps,
            casts_all: mode.recomputes_all(),
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
                    .saturating_add(budget.bricks(per_voxel, Instant::now()))
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

    fn write_uniforms(
        &mut self,
        volume: &ExtractedVolume,
        goal: &Goal,
        depth_map_size: u32,
        dilation_map_size: u32,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) {
        let has_occlusion = self.state.occlusion_for.is_some();
        let uniform = VolumeUniform::new(
            volume,
            self.largest_stored,
            has_occlusion,
            goal.carver_count,
            [depth_map_size, dilation_map_size],
        );
        if self.uniform.buffer().is_none() || *self.uniform.get() != uniform {
            self.uniform.set(uniform);
            self.uniform.write_buffer(device, queue);
        }
        if self.carvers.buffer().is_none() || *self.carvers.get() != goal.carvers {
            self.carvers.set(goal.carvers.clone());
            self.carvers.write_buffer(device, queue);
        }
    }
}

impl Work {
    /// Writes the passes' uniforms and makes their bind groups. `None` where there is nothing to do.
    fn bind(
        self,
        volume: &mut VolumeResources,
        clip: &crate::render::clip_maps::ClipTextures,
        formats: &Formats,
        classify: &ClassifyPipeline,
        ray_cast: &RayCastPipeline,
        counts: bool,
        cache: &PipelineCache,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) -> Option<VolumeJob> {
        if self.precompute.is_none() && !self.classifies {
            return None;
        }
        let pass = OcclusionPassUniform {
            rays: self.rays,
            steps: self.steps,
            ..default()
        };
        if let Some((first_brick, end_brick, _)) = self.precompute {
            volume.unclipped_pass.set(OcclusionPassUniform {
                end_brick: self.volume_bricks,
                ..pass
            });
            volume.unclipped_pass.write_buffer(device, queue);
            volume.precompute_pass.set(OcclusionPassUniform {
                first_brick,
                end_brick,
                casts_all: 1,
                ..pass
            });
            volume.precompute_pass.write_buffer(device, queue);
        }
        volume.carve_pass.set(OcclusionPassUniform {
            end_brick: self.volume_bricks,
            is_clipped: 1,
            casts_all: self.casts_all as u32,
            ..pass
        });
        volume.carve_pass.write_buffer(device, queue);

        let volume = &*volume;
        let precompute = self.precompute.and_then(|(first, end, classifies)| {
            let target = RayCastTarget {
                pass: &volume.precompute_pass,
                written: &volume.unclipped_occlusion.view,
                // Not read: every voxel is cast.
                unclipped: &volume.occlusion.view,
            };
            let classify = classify.bind(volume, &volume.unclipped_pass, cache, device)?;
            Some(PrecomputeJob {
                classify: classifies.then_some(classify),
                volume_bricks: self.volume_bricks,
                cast: ray_cast.bind(volume, target, formats, counts, cache, device)?,
                bricks: end - first,
            })
        });
        let carve = self.classifies.then_some(()).and_then(|()| {
            let target = RayCastTarget {
                pass: &volume.carve_pass,
                written: &volume.occlusion.view,
                unclipped: &volume.unclipped_occlusion.view,
            };
            let cast = ray_cast.bind(volume, target, formats, counts, cache, device)?;
            Some(CarveJob {
                classify: classify.bind(volume, &volume.carve_pass, cache, device)?,
                cast: self.casts.then_some(cast),
                bricks: self.volume_bricks,
            })
        });
        Some(VolumeJob {
            volume_group: volume_bindings::compute_bind_group(volume, clip, formats, cache, device)?,
            precompute,
            carve,
        })
    }
}
