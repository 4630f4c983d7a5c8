//! The frame as a list of passes. `carvers::plan`, `plan` and the methods decided its contents.

use bevy::{
    prelude::*,
    render::{
        mesh::{RenderMesh, allocator::MeshAllocator},
        render_asset::RenderAssets,
        renderer::{RenderContext, RenderQueue},
    },
};

use super::{
    carvers::{clip_draw::MeshSource, clip_maps::ClipMaps, passes::CarverPasses, plan::CarverPlan},
    clipping::passes::ClippingPasses,
    extract::ExtractedScene,
    gpu::{
        compute_pass::{Groups, LIST_HEAD, ListEnd},
        frame::{Frame, Submit, TimesByClock},
    },
    methods::registry::VoxelMethods,
    plan::VolumePlan,
    views::march::MarchPass,
};
use crate::diagnostics::{
    CLIP_COUNTERS, ReportChannel, SPAN_CLIP, SPAN_COUNT, SPAN_CULL, SPAN_DEPTH, SPAN_DILATE, SPAN_DISTANCES,
    SPAN_MARCH, SPAN_RANGES,
};

/// Encodes the passes, once per frame and before any camera, however many cameras there are.
pub(crate) fn encode_passes(
    (carver_plan, volume_plan): (Res<CarverPlan>, Res<VolumePlan>),
    CarverPasses { count, peel, dilate, cache }: CarverPasses,
    clipping: ClippingPasses,
    (march, methods): (Res<MarchPass>, Res<VoxelMethods>),
    clip_maps: Res<ClipMaps>,
    meshes: Res<RenderAssets<RenderMesh>>,
    allocator: Res<MeshAllocator>,
    queue: Res<RenderQueue>,
    timing: Res<TimesByClock>,
    (scene, report): (Res<ExtractedScene>, Res<ReportChannel>),
    ctx: RenderContext,
) {
    let Some(textures) = &clip_maps.textures else {
        return;
    };
    let submit = match () {
        () if timing.0 => Submit::AndWait,
        () if volume_plan.takes_long => Submit::Apart,
        () => Submit::Together,
    };
    let mut frame = Frame::new(ctx, &queue, submit);

    // Step II: depth maps of carvers whose mesh changed, once the number of layers they need is known.
    let source = MeshSource { cache: &cache, meshes: &meshes, allocator: &allocator };
    frame.pass(SPAN_COUNT, &carver_plan.counts, |encoder, job| {
        job.encode(encoder, &count, textures, &source);
    });
    frame.pass(SPAN_DEPTH, &carver_plan.depth_maps, |encoder, job| {
        job.encode(encoder, &peel, textures, &source);
    });

    // Step III: dilation maps of these carvers, and of carvers whose scale or reach changed.
    frame.pass(SPAN_DILATE, &carver_plan.dilations, |encoder, job| {
        job.encode(encoder, &dilate, textures, &cache);
    });

    // Once per volume and stride of its occlusion: the range of intensities around every brick.
    let ClippingPasses { ranges, static_distances, cull_superbricks, cull_bricks, clip, distances, .. } =
        clipping;
    let clips = &volume_plan.clips;
    frame.pass(SPAN_RANGES, clips.iter().filter(|job| job.finds_ranges), |encoder, job| {
        let groups = [&job.volume.volume, &job.groups.ranges];
        ranges.encode(encoder, groups, Groups::Invocations(job.bricks), &cache);
    });

    // Step IV: find the superbricks, then the bricks that a changed carver can affect, and clip their voxels. Then
    // measure the distances from anything visible near them.
    let changed = clips.iter().filter_map(|job| Some((job, job.carve.as_ref()?)));
    frame.pass(SPAN_CULL, changed.clone(), |encoder, (job, carve)| {
        let (volume, groups) = (&job.volume.volume, &job.groups);
        let lists = [volume, &groups.cull_superbricks, &groups.superbricks];
        cull_superbricks.encode(encoder, lists, carve.superbricks, &cache);
        let listed = Groups::Listed(&carve.superbrick_list, ListEnd::Front);
        cull_bricks.encode(encoder, [volume, &groups.cull_bricks, &groups.bricks], listed, &cache);
    });
    frame.pass(SPAN_CLIP, changed.clone(), |encoder, (job, carve)| {
        if carve.begins_anew {
            carve.forget_pending(encoder);
        }
        let groups = [&job.volume.bricks, &job.groups.clip, &job.groups.words];
        clip.encode(encoder, groups, &carve.brick_list, &cache);
    });
    frame.pass(SPAN_DISTANCES, changed, |encoder, (job, carve)| {
        let (volume, groups) = (&job.volume.volume, &job.groups);
        if carve.begins_anew {
            static_distances.encode(encoder, volume, &groups.static_distances, job.bricks, &cache);
        }
        distances.encode(encoder, volume, &groups.distances, &carve.superbrick_list, &cache);
    });

    let counted = clips.iter().filter_map(|job| job.carve.as_ref()).filter(|_| scene.count_work);
    for carve in counted {
        let lists = [&carve.superbrick_list, &carve.brick_list];
        let counts =
            lists.into_iter().flat_map(|list| [ListEnd::Front, ListEnd::Back].map(|end| (list, end)));
        for (name, (list, end)) in CLIP_COUNTERS.into_iter().zip(counts) {
            let count = 4 * u64::from(LIST_HEAD * end as u32 + LIST_HEAD - 1);
            frame.record_word(name, &list.slice(count..count + 4));
        }
    }

    // What the views see, and which occlusion they read.
    frame.pass(SPAN_MARCH, &volume_plan.marches, |encoder, job| march.encode_views(encoder, job, &cache));

    // Step V: the occlusion of voxels, by the methods of the volumes.
    methods.encode(&mut frame, &cache);
    frame.report(&report);
}
