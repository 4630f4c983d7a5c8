//! Which volumes need clipping or casting.

use bevy::{
    prelude::*,
    render::{
        render_resource::{BindGroup, PipelineCache, ShaderType, UniformBuffer, encase::internal::WriteInto},
        renderer::{RenderDevice, RenderQueue},
    },
};
use std::time::Instant;

use super::{
    FramePlan,
    budget::PrecomputeBudget,
    work::{Goal, Work},
};
use crate::{
    diagnostics::ReportChannel,
    render::{
        classify::ClassifyPipeline,
        clip_maps::ClipMaps,
        clip_textures::ClipTextures,
        extract::{ExtractedScene, ExtractedVolume},
        formats::Formats,
        ray_cast::{RayCastPipeline, RayCastTarget},
        volume_bindings,
        volume_store::{VolumeResources, VolumeStore},
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
    let mut share = budget.share(Instant::now());
    let mut precomputes = false;
    for volume in scene.volumes.iter().filter(|volume| volume.is_placed) {
        let Some(resources) = store.0.get_mut(&volume.entity) else {
            continue;
        };
        resources.upload(volume, &device, &queue);
        let carvers = carvers_of(volume, &scene, &plan);
        let table: CarverTable = carvers.iter().map(|(carver, _)| *carver).collect();
        let goal = Goal::of(volume, carvers, scene.clip_settings.coverage);
        let work = if pipelines_ready { resources.advance(volume, &goal, &mut share) } else { default() };
        precomputes |= work.precompute.is_some();
        let done = resources.progress(&goal, volume);
        // Until all carvers carve, nothing is final.
        let done = if plan.carvers_wait || !pipelines_ready { done.min(0.999) } else { done };
        progress.push((volume.entity.id(), done));
        let sizes = [clip.depth_map_size, clip.dilation_map_size()];
        let has_occlusion = resources.state.occlusion_for.is_some();
        let largest = resources.largest_stored;
        let uniform = VolumeUniform::new(volume, largest, has_occlusion, sizes);
        write_if_changed(&mut resources.uniform, uniform, &device, &queue);
        write_if_changed(&mut resources.carvers, table, &device, &queue);
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
    let carving = scene.carvers.iter().filter(|carver| carver.clip_mesh.carves(volume.entity.id()));
    carving
        .filter_map(|carver| {
            let ready = plan.carvers.get(&carver.entity)?;
            Some((CarverUniform::new(carver, ready, volume), ready.revision))
        })
        .collect()
}

/// Puts a value where shaders read it, unless it is there.
fn write_if_changed<T: ShaderType + WriteInto + PartialEq>(
    buffer: &mut UniformBuffer<T>,
    value: T,
    device: &RenderDevice,
    queue: &RenderQueue,
) {
    if buffer.buffer().is_none() || *buffer.get() != value {
        buffer.set(value);
        buffer.write_buffer(device, queue);
    }
}

impl Work {
    /// Writes the passes' uniforms and makes their bind groups. `None` where there is nothing to do.
    fn bind(
        self,
        volume: &mut VolumeResources,
        clip: &ClipTextures,
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
            coverage: self.coverage as u32,
            ..default()
        };
        if let Some((first_brick, end_brick, _)) = self.precompute {
            volume.unclipped_pass.set(OcclusionPassUniform { end_brick: self.volume_bricks, ..pass });
            volume.unclipped_pass.write_buffer(device, queue);
            volume.precompute_pass.set(OcclusionPassUniform { first_brick, end_brick, casts_all: 1, ..pass });
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
