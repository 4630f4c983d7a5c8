//! The frame as a list of passes. What is in the list was decided in `plan`.

use bevy::{
    prelude::*,
    render::{
        diagnostic::RecordDiagnostics,
        mesh::{RenderMesh, allocator::MeshAllocator},
        render_asset::RenderAssets,
        render_resource::PipelineCache,
        renderer::RenderContext,
    },
};

use super::{
    classify::ClassifyPipeline, clip_maps::ClipMaps, dilate::DilatePipelines, plan::FramePlan,
    ray_cast::RayCastPipeline,
};
use crate::diagnostics::{
    COUNTERS, ReportChannel, SPAN_CLASSIFY, SPAN_DEPTH, SPAN_DILATE, SPAN_PRECOMPUTE, SPAN_RAY_CAST,
};

/// Encodes the passes, once per frame and before any camera, however many cameras there are.
pub(crate) fn encode_passes(
    plan: Res<FramePlan>,
    clip_maps: Res<ClipMaps>,
    cache: Res<PipelineCache>,
    meshes: Res<RenderAssets<RenderMesh>>,
    allocator: Res<MeshAllocator>,
    dilate: Res<DilatePipelines>,
    classify: Res<ClassifyPipeline>,
    ray_cast: Res<RayCastPipeline>,
    report: Res<ReportChannel>,
    mut ctx: RenderContext,
) {
    let Some(clip) = &clip_maps.textures else {
        return;
    };
    let recorder = ctx.diagnostic_recorder();
    let recorder = recorder.as_deref();
    let encoder = ctx.command_encoder();
    let counts = plan.counts_work;
    if counts {
        encoder.clear_buffer(&ray_cast.work, 0, None);
    }

    // Step II: depth maps of carvers whose mesh changed.
    if !plan.depth_maps.is_empty() {
        let span = recorder.time_span(encoder, SPAN_DEPTH);
        for job in &plan.depth_maps {
            job.encode(encoder, clip, &cache, &meshes, &allocator);
        }
        span.end(encoder);
    }

    // Step III: dilation maps of those, and of carvers whose scale or reach changed.
    if !plan.dilations.is_empty() {
        let span = recorder.time_span(encoder, SPAN_DILATE);
        for job in &plan.dilations {
            job.encode(encoder, &dilate, clip, &cache);
        }
        span.end(encoder);
    }

    // Step I: a portion of the unclipped occlusion of volumes that lack it.
    let precomputes = || {
        let jobs = plan.volumes.iter();
        jobs.filter_map(|job| Some((job, job.precompute.as_ref()?)))
    };
    if precomputes().next().is_some() {
        let span = recorder.time_span(encoder, SPAN_PRECOMPUTE);
        for (job, precompute) in precomputes() {
            if let Some(group) = &precompute.classify {
                classify.encode(
                    encoder,
                    [&job.volume_group, group],
                    precompute.volume_bricks,
                    &cache,
                );
            }
            let groups = [&job.volume_group, &precompute.cast];
            ray_cast.encode(encoder, groups, precompute.bricks, counts, &cache);
        }
        span.end(encoder);
    }

    // Step IV: opacities and categories of volumes that carvers changed.
    let carves = || {
        let jobs = plan.volumes.iter();
        jobs.filter_map(|job| Some((job, job.carve.as_ref()?)))
    };
    if carves().next().is_some() {
        let span = recorder.time_span(encoder, SPAN_CLASSIFY);
        for (job, carve) in carves() {
            let groups = [&job.volume_group, &carve.classify];
            classify.encode(encoder, groups, carve.bricks, &cache);
        }
        span.end(encoder);
    }

    // Step V: their occlusion.
    let casts = || carves().filter_map(|(job, carve)| Some((job, carve, carve.cast.as_ref()?)));
    if casts().next().is_some() {
        let span = recorder.time_span(encoder, SPAN_RAY_CAST);
        for (job, carve, cast) in casts() {
            ray_cast.encode(encoder, [&job.volume_group, cast], carve.bricks, counts, &cache);
        }
        span.end(encoder);
    }

    if counts {
        for (name, offset) in COUNTERS.into_iter().zip((0..).step_by(4)) {
            recorder.record_u32(encoder, &ray_cast.work.slice(offset..offset + 4), name);
        }
    }
    if let Ok(mut report) = report.0.lock() {
        let passes = &mut report.passes;
        passes.depth_maps += plan.depth_maps.len() as u64;
        passes.dilations += plan.dilations.len() as u64;
        passes.precomputations += precomputes().count() as u64;
        passes.classifications += carves().count() as u64;
        passes.ray_casts += casts().count() as u64;
    }
}
