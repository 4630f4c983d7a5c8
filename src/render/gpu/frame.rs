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

/// Passes of methods over a view, behind its main pass.
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct ShadesViews;

/// When the commands of a frame's passes are submitted.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Submit {
    /// With those of all others.
    Together,
    /// Each pass by itself, so that none takes long for a device.
    Apart,
    /// The same, and the CPU waits for each.
    AndWait,
}

/// Passes being encoded.
pub struct Frame<'w, 's, 'a> {
    ctx: RenderContext<'w, 's>,
    queue: &'a RenderQueue,
    submit: Submit,
    /// Span, number of jobs and, if timed by the clock, milliseconds of each pass.
    ran: Vec<(&'static str, u64, Option<f64>)>,
}

impl<'w, 's, 'a> Frame<'w, 's, 'a> {
    pub(crate) fn new(ctx: RenderContext<'w, 's>, queue: &'a RenderQueue, submit: Submit) -> Self {
        Self { ctx, queue, submit, ran: Vec::new() }
    }

    /// Frame in the schedule of a view. If passes are timed by the clock, all earlier passes run first. Their commands
    /// must be applied by then ([`are_timed_by_clock`]).
    pub(crate) fn of_view(
        ctx: RenderContext<'w, 's>,
        queue: &'a RenderQueue,
        timing: &TimesByClock,
        before: &mut FlushCommands,
    ) -> Self {
        let frame = Self::new(ctx, queue, if timing.0 { Submit::AndWait } else { Submit::Together });
        if timing.0 {
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
        self.pass_in_parts(span, jobs, |_| true, &mut encode);
    }

    /// The same for a pass whose jobs have parts, which may be submitted one by one. `is_first` tells the first part of
    /// a job.
    pub(crate) fn pass_in_parts<P>(
        &mut self,
        span: &'static str,
        parts: impl IntoIterator<Item = P>,
        is_first: impl Fn(&P) -> bool,
        mut encode: impl FnMut(&mut CommandEncoder, P),
    ) {
        let mut parts = parts.into_iter().peekable();
        if parts.peek().is_none() {
            return;
        }
        let mut jobs = 0;
        if self.submit == Submit::Together {
            let recorder = self.ctx.diagnostic_recorder();
            let recorder = recorder.as_deref();
            let encoder = self.ctx.command_encoder();
            let time_span = recorder.time_span(encoder, span);
            for part in parts {
                jobs += u64::from(is_first(&part));
                encode(encoder, part);
            }
            time_span.end(encoder);
            self.ran.push((span, jobs, None));
            return;
        }
        let device = self.ctx.render_device();
        let begin = Instant::now();
        for part in parts {
            jobs += u64::from(is_first(&part));
            let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
            encode(&mut encoder, part);
            self.queue.submit([encoder.finish()]);
        }
        let waits = self.submit == Submit::AndWait;
        if waits {
            wait(device);
        }
        self.ran.push((span, jobs, waits.then(|| begin.elapsed().as_secs_f64() * 1e3)));
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

fn wait(device: &RenderDevice) {
    // An error means that the device was lost: there is nothing to wait for.
    let _ = device.poll(PollType::wait_indefinitely());
}

/// Whether passes are timed by the clock. If so, a pass in the schedule of a view needs an `ApplyDeferred` before it.
/// That schedule inserts none by itself.
pub(crate) fn are_timed_by_clock(timing: Res<TimesByClock>) -> bool {
    timing.0
}
