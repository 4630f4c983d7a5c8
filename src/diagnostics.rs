//! What a user can read about the work done: names of the passes' timings and work counters.
//!
//! Timings need Bevy's `RenderDiagnosticsPlugin`; they appear in the `DiagnosticsStore` as
//! milliseconds, under the paths given here. Passes of an occlusion method have their names with its settings, such as
//! [`OcclusionSweeping::SPAN`](crate::occlusion::OcclusionSweeping::SPAN).

use bevy::{
    diagnostic::{DiagnosticPath, DiagnosticsStore},
    prelude::*,
};
use std::sync::{Arc, Mutex};

use crate::clip::ClipMeshCutOff;

/// Counting the surfaces of carvers whose mesh changed (before step II).
pub const SPAN_COUNT: &str = "contextual_ao/count_surfaces";
/// Rendering the depth maps of carvers that changed (step II).
pub const SPAN_DEPTH: &str = "contextual_ao/clip_depth";
/// Computing the dilation maps of carvers that changed (step III).
pub const SPAN_DILATE: &str = "contextual_ao/dilate";
/// Finding the range of intensities in the bricks of a new volume.
pub const SPAN_RANGES: &str = "contextual_ao/ranges";
/// Finding the bricks that carvers that changed can affect (step IV).
pub const SPAN_CULL: &str = "contextual_ao/cull";
/// Clipping their voxels, and finding those whose occlusion is stale (step IV).
pub const SPAN_CLIP: &str = "contextual_ao/clip";
/// Finding out how far rays may leap.
pub const SPAN_DISTANCES: &str = "contextual_ao/distances";
/// Finding the voxels that views will read.
pub const SPAN_MARK: &str = "contextual_ao/mark";
/// Casting the rays of those that are not up to date (step V).
pub const SPAN_RAY_CAST: &str = "contextual_ao/ray_cast";
/// Bevy's span in which volumes are drawn, with everything else that is transparent.
pub const SPAN_DRAW: &str = "main_transparent_pass_3d";

/// Names of the work counters: low and high 32 bits of voxels cast, of samples taken, of distances read.
pub(crate) const COUNTERS: [&str; 6] = [
    "contextual_ao/voxels_low",
    "contextual_ao/voxels_high",
    "contextual_ao/samples_low",
    "contextual_ao/samples_high",
    "contextual_ao/distances_low",
    "contextual_ao/distances_high",
];

/// Counts the ray cast's work on the GPU while `true`. Counting slows the ray cast down. A device without queries of
/// time or statistics counts nothing, with a warning.
#[derive(Resource, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Resource, Default, Debug, Clone, PartialEq)]
pub struct CountWork(pub bool);

/// What the ray cast did in one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Voxels whose occlusion was cast.
    pub voxels: u64,
    /// Opacity samples taken for them.
    pub samples: u64,
    /// Distances looked up to leap over what is empty.
    pub distances: u64,
}

/// The latest counted [`Work`], while [`CountWork`] is on and a ray cast ran.
pub fn latest_work(diagnostics: &DiagnosticsStore) -> Option<Work> {
    let read = |name: &str| {
        let path = DiagnosticPath::from_components(["render", name]);
        diagnostics.get(&path)?.measurement().map(|m| m.value as u64)
    };
    let word = |low: &str, high: &str| Some(read(low)? | read(high)? << 32);
    Some(Work {
        voxels: word(COUNTERS[0], COUNTERS[1])?,
        samples: word(COUNTERS[2], COUNTERS[3])?,
        distances: word(COUNTERS[4], COUNTERS[5])?,
    })
}

/// The latest time on the GPU of a span, milliseconds.
pub fn latest_gpu_ms(diagnostics: &DiagnosticsStore, span: &str) -> Option<f64> {
    let path = DiagnosticPath::from_components(["render", span, "elapsed_gpu"]);
    diagnostics.get(&path)?.measurement().map(|m| m.value)
}

/// What the plugin holds on the GPU, as of the last frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GpuUsage {
    /// Textures alive.
    pub textures: u32,
    /// Buffers alive whose size depends on volumes.
    pub buffers: u32,
    /// Bytes in both, as the textures' formats count.
    pub bytes: u64,
}

impl core::ops::Add for GpuUsage {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            textures: self.textures + other.textures,
            buffers: self.buffers + other.buffers,
            bytes: self.bytes + other.bytes,
        }
    }
}

/// What the render world reports to the main world.
#[derive(Default)]
pub(crate) struct Report {
    /// Volumes that are seen, and whether their occlusion is ready.
    pub ready: Vec<(Entity, bool)>,
    pub usage: GpuUsage,
    pub passes: PassLog,
    /// Layers that the carvers' meshes need in all.
    pub layers_wanted: u32,
    /// Carvers whose meshes have more layers than they get.
    pub cut_off: Vec<ClipMeshCutOff>,
}

/// Times every pass by the clock while `true`, waiting for the GPU after each.
///
/// It slows frames down, and is for drivers whose timestamps say nothing about compute passes
/// (Mesa's software driver) or that have none.
#[derive(Resource, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Resource, Default, Debug, Clone, PartialEq)]
pub struct TimePassesByClock(pub bool);

/// Which passes ran since the start, in the order in which they first ran; a frame at rest adds nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PassLog(Vec<PassRuns>);

/// The runs of one pass.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PassRuns {
    span: &'static str,
    jobs: u64,
    clock_ms: Option<f64>,
}

impl PassLog {
    pub(crate) fn add(&mut self, span: &'static str, jobs: u64, ms: Option<f64>) {
        match self.0.iter_mut().find(|runs| runs.span == span) {
            Some(runs) => *runs = PassRuns { span, jobs: runs.jobs + jobs, clock_ms: ms },
            None => self.0.push(PassRuns { span, jobs, clock_ms: ms }),
        }
    }

    /// The names of all passes that ran since the start.
    pub fn spans(&self) -> impl Iterator<Item = &'static str> {
        self.0.iter().map(|runs| runs.span)
    }

    /// How many carvers, volumes or views a pass has been run for since the start, by its name.
    pub fn jobs(&self, span: &str) -> u64 {
        self.runs(span).map_or(0, |runs| runs.jobs)
    }

    /// Milliseconds that the pass took when it last ran, if timed by the clock.
    pub fn clock_ms(&self, span: &str) -> Option<f64> {
        self.runs(span)?.clock_ms
    }

    /// Passes run since the start, of any kind.
    pub fn total_jobs(&self) -> u64 {
        self.0.iter().map(|runs| runs.jobs).sum()
    }

    fn runs(&self, span: &str) -> Option<&PassRuns> {
        self.0.iter().find(|runs| runs.span == span)
    }
}

/// Connects the render world's [`Report`] with the main world.
#[derive(Resource, Clone, Default)]
pub(crate) struct ReportChannel(pub Arc<Mutex<Report>>);

/// What the renderer did and holds.
#[derive(Resource, Clone, Debug, Default, PartialEq)]
pub struct RenderStatus {
    /// What is allocated.
    pub usage: GpuUsage,
    /// What has run.
    pub passes: PassLog,
    /// Layers of the depth maps of all carvers together.
    pub clip_layers: u32,
}
