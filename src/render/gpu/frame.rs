//! Encoding, timing and counting of passes: passes of all views together, and passes of one view.

use bevy::{
    prelude::*,
    render::{
        diagnostic::RecordDiagnostics,
        render_resource::{BufferSlice, CommandEncoder, CommandEncoderDescriptor, PollType},
        renderer::{FlushCommands, RenderContext, RenderDevice, RenderQueue},
    },
};
use std::time::Instant;

use crate::diagnostics::ReportChannel;

/// Whether the CPU waits for every pass and times it by the clock.
#[derive(Resource, Default)]
pub(crate) struct TimesByClock(pub bool);

/// Passes being encoded.
pub struct Frame<'w, 's, 'a> {
    ctx: RenderContext<'w, 's>,
    queue: &'a RenderQueue,
    times_by_clock: bool,
    /// Span, number of jobs and, if timed by the clock, milliseconds of each pass.
    ran: Vec<(&'static str, u64, Option<f64>)>,
}

impl<'w, 's, 'a> Frame<'w, 's, 'a> {
    pub(crate) fn new(ctx: RenderContext<'w, 's>, queue: &'a RenderQueue, timing: &TimesByClock) -> Self {
        Self { ctx, queue, times_by_clock: timing.0, ran: Vec::new() }
    }

    /// Frame in the schedule of a view. If passes are timed by the clock, all earlier passes run first. Their commands
    /// must be applied by then ([`are_timed_by_clock`]).
    pub(crate) fn of_view(
        ctx: RenderContext<'w, 's>,
        queue: &'a RenderQueue,
        timing: &TimesByClock,
        before: &mut FlushCommands,
    ) -> Self {
        let frame = Self::new(ctx, queue, timing);
        if frame.times_by_clock {
            before.flush();
            wait(frame.ctx.render_device());
        }
        frame
    }

    /// Encoder for commands outside passes. If passes are timed by the clock, its commands are submitted after all of
    /// them.
    pub fn encoder(&mut self) -> &mut CommandEncoder {
        self.ctx.command_encoder()
    }

    /// Encodes one pass over its jobs, or nothing if there are no jobs. `span` is its name in the diagnostics.
    pub fn pass<J>(
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

    /// Sends a word of a buffer to the diagnostics.
    pub(crate) fn record_word(&mut self, name: &'static str, word: &BufferSlice) {
        let recorder = self.ctx.diagnostic_recorder();
        let recorder = recorder.as_deref();
        recorder.record_u32(self.ctx.command_encoder(), word, name);
    }

    pub(crate) fn report(self, channel: &ReportChannel) {
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
    wait(device);
    begin.elapsed().as_secs_f64() * 1e3
}

fn wait(device: &RenderDevice) {
    // An error means that the device was lost: there is nothing to wait for.
    let _ = device.poll(PollType::wait_indefinitely());
}

/// Whether passes are timed by the clock. If so, a pass in the schedule of a view needs an `ApplyDeferred` before it.
/// That schedule inserts none by itself.
pub(crate) fn are_timed_by_clock(timing: Res<TimesByClock>) -> bool {
    timing.0
}
