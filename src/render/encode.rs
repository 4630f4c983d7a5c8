//! The frame as a list of passes. What is in the list was decided in `plan`.

use bevy::{
    prelude::*,
    render::{
        diagnostic::RecordDiagnostics,
        mesh::{RenderMesh, allocator::MeshAllocator},
        render_asset::RenderAssets,
        render_resource::{CommandEncoder, CommandEncoderDescriptor, PollType},
        renderer::{RenderContext, RenderDevice, RenderQueue},
    },
};
use std::time::Instant;

use super::{
    clip_draw::MeshSource, clip_maps::ClipMaps, compute_pass::Groups, passes::Passes, plan::FramePlan,
    ray_cast::RayCastPasses,
};
use crate::diagnostics::{
    COUNTERS, ReportChannel, SPAN_CLIP, SPAN_COUNT, SPAN_CULL, SPAN_DEPTH, SPAN_DILATE, SPAN_DISTANCES,
    SPAN_FILTER, SPAN_MARK, SPAN_RANGES, SPAN_RAY_CAST,
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
    let Passes { count, peel, dilate, ranges, cull, clip, distances, filtering, mark, ray_cast, cache } =
        passes;
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
        ranges.encode(encoder, [&job.volume_group, group], Groups::Bricks(job.bricks), &cache);
    });

    // Step IV: find the bricks that a changed carver can affect, clip their voxels, and measure how
    // far all bricks are from anything that can be seen.
    let changed = volumes.iter().filter_map(|job| Some((job, job.clip.as_ref()?)));
    frame.pass(SPAN_CULL, changed.clone(), |encoder, (job, step)| {
        let groups = [&job.volume_group, &step.cull, &step.listed];
        cull.encode(encoder, groups, Groups::Bricks(job.bricks), &cache);
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
    let filters = volumes.iter().filter_map(|job| Some((job, job.filter.as_ref()?)));
    frame.pass(SPAN_FILTER, filters, |encoder, (job, filter)| {
        filtering.encode(encoder, &job.bricks_group, filter, &cache);
    });

    if counts {
        frame.record_work(&ray_cast);
    }
    frame.report(&report);
}

/// A frame being encoded: how its passes are timed and counted.
struct Frame<'w, 's, 'a> {
    ctx: RenderContext<'w, 's>,
    queue: &'a RenderQueue,
    times_by_clock: bool,
    /// Span, number of jobs and, if timed by the clock, milliseconds.
    ran: Vec<(&'static str, u64, Option<f64>)>,
}

impl<'w, 's, 'a> Frame<'w, 's, 'a> {
    fn new(ctx: RenderContext<'w, 's>, queue: &'a RenderQueue, plan: &FramePlan) -> Self {
        Self {
            ctx,
            queue,
            // The counters are cleared and read in the order of the frame.
            times_by_clock: plan.times_by_clock && !plan.counts_work,
            ran: Vec::new(),
        }
    }

    fn encoder(&mut self) -> &mut CommandEncoder {
        self.ctx.command_encoder()
    }

    /// One pass over its jobs; nothing where there are none.
    fn pass<J>(
        &mut self,
        span: &'static str,
        jobs: impl IntoIterator<Item = J>,
        mut encode: impl FnMut(&mut CommandEncoder, J),
    ) {
        let mut jobs = jobs.into_iter().peekable();
        if jobs.peek().is_none() {
            return;
        }
        let mut count = 0;
        let encode_all = |encoder: &mut CommandEncoder| {
            for job in jobs {
                encode(encoder, job);
                count += 1;
            }
        };
        if self.times_by_clock {
            let ms = submit_and_wait(self.ctx.render_device(), self.queue, encode_all);
            self.ran.push((span, count, Some(ms)));
        } else {
            let recorder = self.ctx.diagnostic_recorder();
            let recorder = recorder.as_deref();
            let encoder = self.ctx.command_encoder();
            let time_span = recorder.time_span(encoder, span);
            encode_all(encoder);
            time_span.end(encoder);
            self.ran.push((span, count, None));
        }
    }

    /// Sends the counters to the diagnostics.
    fn record_work(&mut self, ray_cast: &RayCastPasses) {
        let recorder = self.ctx.diagnostic_recorder();
        let recorder = recorder.as_deref();
        for (name, offset) in COUNTERS.into_iter().zip((0..).step_by(4)) {
            let word = ray_cast.work.slice(offset..offset + 4);
            recorder.record_u32(self.ctx.command_encoder(), &word, name);
        }
    }

    fn report(self, channel: &ReportChannel) {
        let Ok(mut report) = channel.0.lock() else {
            return;
        };
        for (span, jobs, ms) in self.ran {
            report.passes.add(span, jobs, ms);
        }
    }
}

/// Runs commands at once and returns the milliseconds until they were done.
fn submit_and_wait(
    device: &RenderDevice,
    queue: &RenderQueue,
    encode: impl FnOnce(&mut CommandEncoder),
) -> f64 {
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
    encode(&mut encoder);
    let begin = Instant::now();
    queue.submit([encoder.finish()]);
    // An error means that the device was lost: then there is nothing to wait for.
    let _ = device.poll(PollType::wait_indefinitely());
    begin.elapsed().as_secs_f64() * 1e3
}
