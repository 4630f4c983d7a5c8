//! Part of the panel with the costs of the passes.

use bevy::{
    diagnostic::{DiagnosticsStore, FrameTimeDiagnosticsPlugin},
    prelude::*,
};
use bevy_contextual_ao::diagnostics::{GpuUsage, RenderStatus, SPAN_DRAW, TimePassesByClock, latest_gpu_ms};
use bevy_egui::egui::{Grid, Ui};
use std::{
    collections::HashMap,
    time::{Duration, Instant},
};

/// A pass that last ran longer ago than this is at rest.
const STALE: Duration = Duration::from_secs(2);
const BYTES_PER_MIB: f64 = 1_048_576.0;

/// Jobs of each pass, and the time of its last run.
#[derive(Default)]
pub struct LastRuns(HashMap<&'static str, (u64, Instant)>);

impl LastRuns {
    /// Whether a pass did a job lately. `jobs` is the number of its jobs since the start.
    fn is_recent(&mut self, pass: &'static str, jobs: u64) -> bool {
        match self.0.get(pass) {
            Some((before, at)) if *before == jobs => at.elapsed() < STALE,
            _ => {
                self.0.insert(pass, (jobs, Instant::now()));
                true
            }
        }
    }
}

/// Shows the time of each pass, the number of its runs, and the resources on the GPU.
pub fn show(
    ui: &mut Ui,
    diagnostics: &DiagnosticsStore,
    status: &RenderStatus,
    last_runs: &mut LastRuns,
    mut by_clock: Mut<TimePassesByClock>,
) {
    let fps = diagnostics.get(&FrameTimeDiagnosticsPlugin::FPS).and_then(|fps| fps.smoothed());
    let passes = &status.passes;
    Grid::new("timings").num_columns(3).striped(true).show(ui, |ui| {
        let mut row = |name: &str, ms: Option<f64>, jobs: String| {
            ui.label(name);
            match ms {
                Some(ms) => ui.monospace(format!("{ms:.2} ms")),
                None => ui.weak("at rest"),
            };
            ui.weak(jobs);
            ui.end_row();
        };
        for span in passes.spans() {
            let ms =
                passes.clock_ms(span).filter(|_| by_clock.0).or_else(|| latest_gpu_ms(diagnostics, span));
            let name = span.rsplit('/').next().unwrap_or(span).replace('_', " ");
            let jobs = passes.jobs(span);
            let is_recent = last_runs.is_recent(span, jobs);
            row(&name, ms.filter(|_| is_recent), format!("{jobs} so far"));
        }
        row("drawing", latest_gpu_ms(diagnostics, SPAN_DRAW), String::new());
    });
    let mut is_by_clock = by_clock.0;
    ui.checkbox(&mut is_by_clock, "time by the clock (waits after each pass)");
    by_clock.set_if_neq(TimePassesByClock(is_by_clock));
    let usage = status.usage;
    let mib = usage.bytes as f64 / BYTES_PER_MIB;
    let GpuUsage { textures, buffers, .. } = usage;
    ui.label(format!("{textures} textures and {buffers} buffers of {mib:.1} MiB on the GPU"));
    if let Some(fps) = fps {
        ui.label(format!("{fps:.1} frames per second"));
    }
}
