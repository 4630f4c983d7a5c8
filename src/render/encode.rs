//! The frame as a list of passes. What is in the list was decided in `plan`.

use bevy::{
    prelude::*,
    render::{
        mesh::{RenderMesh, allocator::MeshAllocator},
        render_asset::RenderAssets,
        renderer::{RenderContext, RenderQueue},
    },
};

use super::{
    carvers::{clip_draw::MeshSource, clip_maps::ClipMaps},
    frame::Frame,
    gpu::compute_pass::Groups,
    passes::Passes,
    plan::FramePlan,
};
use crate::diagnostics::{
    ReportChannel, SPAN_CLIP, SPAN_COUNT, SPAN_CULL, SPAN_DEPTH, SPAN_DILATE, SPAN_DISTANCES, SPAN_FILTER,
    SPAN_MARK, SPAN_RANGES, SPAN_RAY_CAST, SPAN_SWEEP,
};

/// Encodes the passes, once per frame and before any camera, however many cameras there are.
pub(crate) fn encode_passes(
    plan: Res<FramePlan>,
    passes: Passes,
    clip_maps: Res<ClipMaps>,
    meshes: Res<RenderAssets<RenderMesh>>,
    allocator: Res<MeshAllocator>,
    queue: Res<RenderQueue>,
    report: Res<ReportChannel>,
    ctx: RenderContext,
) {
    let Passes {
        count,
        peel,
        dilate,
        ranges,
        cull,
        clip,
        distances,
        filtering,
        mark,
        ray_cast,
        sweep,
        cache,
        ..
    } = passes;
    let Some(textures) = &clip_maps.textures else {
        return;
    };
    let counts = plan.counts_work;
    let mut frame = Frame::new(ctx, &queue, &plan);
    if counts {
        frame.encoder().clear_buffer(&ray_cast.work, 0, None);
    }

    // Step II: depth maps of carvers whose mesh changed, when it is known how many layers they need.
    let source = MeshSource { cache: &cache, meshes: &meshes, allocator: &allocator };
    frame.pass(SPAN_COUNT, &plan.counts, |encoder, job| {
        job.encode(encoder, &count, textures, &source);
    });
    frame.pass(SPAN_DEPTH, &plan.depth_maps, |encoder, job| {
        job.encode(encoder, &peel, textures, &source);
    });

    // Step III: dilation maps of those, and of carvers whose scale or reach changed.
    frame.pass(SPAN_DILATE, &plan.dilations, |encoder, job| {
        job.encode(encoder, &dilate, textures, &cache);
    });

    // Once per volume: the range of intensities in every brick.
    let volumes = &plan.volumes;
    let unknown = volumes.iter().filter_map(|job| Some((job, job.ranges.as_ref()?)));
    frame.pass(SPAN_RANGES, unknown, |encoder, (job, group)| {
        ranges.encode(encoder, [&job.volume_group, group], Groups::Invocations(job.bricks), &cache);
    });

    // Step IV: find the bricks that a changed carver can affect, clip their voxels, and measure how
    // far all bricks are from anything that can be seen.
    let changed = volumes.iter().filter_map(|job| Some((job, job.clip.as_ref()?)));
    frame.pass(SPAN_CULL, changed.clone(), |encoder, (job, step)| {
        let groups = [&job.volume_group, &step.cull, &step.listed];
        cull.encode(encoder, groups, Groups::Invocations(job.bricks), &cache);
    });
    frame.pass(SPAN_CLIP, changed.clone(), |encoder, (job, step)| {
        step.forget_pending(encoder);
        let groups = [&job.bricks_group, &step.clip, &job.words];
        clip.encode(encoder, groups, &step.brick_list, &cache);
    });
    frame.pass(SPAN_DISTANCES, changed, |encoder, (job, step)| {
        distances.encode(encoder, &job.volume_group, &step.distances, job.bricks, &cache);
    });

    // Step V: find the voxels that will be read and are not up to date, and cast their rays.
    let views = volumes.iter().flat_map(|job| job.marks.iter().map(move |view| (job, view)));
    frame.pass(SPAN_MARK, views, |encoder, (job, view)| {
        let groups = [&job.bricks_group, &view.window, &job.words];
        mark.encode(encoder, groups, Groups::Pixels(view.pixels), &cache);
    });
    let casts = volumes.iter().filter_map(|job| Some((job, job.cast.as_ref()?)));
    frame.pass(SPAN_RAY_CAST, casts, |encoder, (job, cast)| {
        ray_cast.encode(encoder, &job.bricks_group, cast, &cache);
    });

    // Or, by other methods, the occlusion of all voxels.
    let sweeps = volumes.iter().filter_map(|job| Some((job, job.sweep.as_ref()?)));
    frame.pass(SPAN_SWEEP, sweeps, |encoder, (job, swept)| {
        sweep.encode(encoder, &job.bricks_group, swept, &cache);
    });
    let filters = volumes.iter().filter_map(|job| Some((job, job.filter.as_ref()?)));
    frame.pass(SPAN_FILTER, filters, |encoder, (job, filter)| {
        filtering.encode(encoder, &job.bricks_group, filter, &cache);
    });

    if counts {
        frame.record_work(&ray_cast);
    }
    frame.report(&report);
}
