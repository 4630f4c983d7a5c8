//! Names of the passes' timings and of the work counters, for users to read.
//!
//! Timings need Bevy's `RenderDiagnosticsPlugin`. They appear in the `DiagnosticsStore` in milliseconds, under the
//! paths given here. An occlusion method's settings name its passes, such as
//! [`OcclusionSweeping::SPAN`](crate::occlusion::OcclusionSweeping::SPAN).

use bevy::{
    diagnostic::{DiagnosticPath, DiagnosticsStore},
    prelude::*,
};
use core::time::Duration;
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
/// Finding the bricks that changed carvers can affect (step IV).
pub const SPAN_CULL: &str = "contextual_ao/cull";
/// Clipping the voxels of the affected bricks, and finding voxels whose occlusion is stale (step IV).
pub const SPAN_CLIP: &str = "contextual_ao/clip";
/// Computing the distances that rays may leap.
pub const SPAN_DISTANCES: &str = "contextual_ao/distances";
/// Following the view rays of volumes that changed or are seen differently, to find what will be drawn.
pub const SPAN_MARCH: &str = "contextual_ao/march";
/// Shading the outlines of volumes in views with `Msaa`. It has no jobs in [`PassLog`]: it is a part of drawing.
pub const SPAN_OUTLINES: &str = "contextual_ao/outlines";
/// Following the rays of lights through volumes that cast shadows. It has no jobs in [`PassLog`]: it is a part of drawing.
pub const SPAN_SHADOWS: &str = "contextual_ao/shadows";
/// Finding the transmittance of volumes that share space. It has no jobs in [`PassLog`]: it is a part of drawing.
pub const SPAN_TRANSMITTANCE: &str = "contextual_ao/transmittance";
/// Bevy's span for drawing volumes and all other transparent objects.
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

/// Names of the counts of clipping: superbricks visited, superbricks whose distances were found, bricks clipped, bricks
/// in which only occlusion became stale.
pub(crate) const CLIP_COUNTERS: [&str; 4] = [
    "contextual_ao/superbricks_visited",
    "contextual_ao/superbricks_measured",
    "contextual_ao/bricks_clipped",
    "contextual_ao/bricks_expired",
];

/// Counts the ray cast's work on the GPU while `true`. Counting slows the ray cast down. A device without timestamp or
/// statistics queries counts nothing and logs a warning.
#[derive(Resource, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Resource, Default, Debug, Clone, PartialEq)]
pub struct CountWork(pub bool);

/// Work of the ray cast in one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Voxels whose rays were cast.
    pub voxels: u64,
    /// Opacity samples taken for these voxels.
    pub samples: u64,
    /// Distances looked up to leap over empty space.
    pub distances: u64,
}

/// Work of clipping in one frame (step IV), of all volumes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClipWork {
    /// Superbricks of 16x16x16 voxels that were tested, the second time with their neighbours.
    pub superbricks_tested: u64,
    /// Superbricks whose bricks were visited.
    pub superbricks_visited: u64,
    /// Superbricks in which the distances were found anew that rays may leap.
    pub superbricks_measured: u64,
    /// Bricks of 4x4x4 voxels whose voxels were clipped anew.
    pub bricks_clipped: u64,
    /// Bricks in which only occlusion became stale.
    pub bricks_expired: u64,
}

impl ClipWork {
    /// Bricks touched by all passes.
    pub fn bricks(&self) -> u64 {
        64 * (self.superbricks_visited + self.superbricks_measured)
            + self.bricks_clipped
            + self.bricks_expired
    }

    /// Bytes that the passes fetch and store for superbricks, bricks and voxels, each as often as a shader asks for
    /// it. A voxel has `intensity_bytes`. Settings, carvers and clip maps are left out.
    pub fn bytes(&self, intensity_bytes: u64) -> u64 {
        // A stamp, then those of 27 superbricks.
        let tested = 2 + 27;
        // Its place in two lists; of each brick the range, two counts, the carvers and its place in a list.
        let visited = 3 + 64 * 5;
        // Of each brick the range, two counts and the masks of 27 bricks; then the states of 27 superbricks, and of
        // each brick the carvers, the distance and the word.
        let measured = 2 + 64 * (3 + 27 * 2) + 2 + 27 * 2 + 64 * 3;
        // The list, the range, the carvers and the masks.
        let clipped = 1 + 3 + 1 + 8;
        let expired = 1 + 4;
        // Intensity and opacity.
        let voxels = 64 * self.bricks_clipped * (intensity_bytes + 1);
        let words = [
            (self.superbricks_tested, tested),
            (self.superbricks_visited, visited),
            (self.superbricks_measured, measured),
            (self.bricks_clipped, clipped),
            (self.bricks_expired, expired),
        ];
        voxels + 4 * words.iter().map(|(count, words)| count * words).sum::<u64>()
    }
}

/// The latest counted [`ClipWork`], while [`CountWork`] is on and a volume was clipped.
pub fn latest_clip_work(diagnostics: &DiagnosticsStore, status: &RenderStatus) -> Option<ClipWork> {
    let [visited, measured, clipped, expired] = CLIP_COUNTERS.map(|name| latest_count(diagnostics, name));
    Some(ClipWork {
        superbricks_tested: status.superbricks_tested,
        superbricks_visited: visited?,
        superbricks_measured: measured?,
        bricks_clipped: clipped?,
        bricks_expired: expired?,
    })
}

/// The latest counted [`Work`], while [`CountWork`] is on and a ray cast ran.
pub fn latest_work(diagnostics: &DiagnosticsStore) -> Option<Work> {
    let read = |name: &str| latest_count(diagnostics, name);
    let word = |low: &str, high: &str| Some(read(low)? | read(high)? << 32);
    Some(Work {
        voxels: word(COUNTERS[0], COUNTERS[1])?,
        samples: word(COUNTERS[2], COUNTERS[3])?,
        distances: word(COUNTERS[4], COUNTERS[5])?,
    })
}

/// The latest value of a diagnostic. Values of several volumes or views in one frame are added up.
fn latest_sum(diagnostics: &DiagnosticsStore, path: &DiagnosticPath) -> Option<f64> {
    let diagnostic = diagnostics.get(path)?;
    // Bevy gives all measurements of a frame one time.
    let latest = diagnostic.measurement()?.time;
    Some(diagnostic.measurements().filter(|m| m.time == latest).map(|m| m.value).sum())
}

fn latest_count(diagnostics: &DiagnosticsStore, name: &str) -> Option<u64> {
    latest_sum(diagnostics, &DiagnosticPath::from_components(["render", name])).map(|sum| sum as u64)
}

/// The latest GPU time of a span, milliseconds. A span that ran for several views of a frame has the sum.
pub fn latest_gpu_ms(diagnostics: &DiagnosticsStore, span: &str) -> Option<f64> {
    let path = DiagnosticPath::from_components(["render", span, "elapsed_gpu"]);
    latest_sum(diagnostics, &path)
}

/// Resources that the plugin holds on the GPU, as of the last frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GpuUsage {
    /// Number of live textures.
    pub textures: u32,
    /// Number of live buffers whose size depends on volumes.
    pub buffers: u32,
    /// Bytes of both, textures counted by their formats.
    pub bytes: u64,
    /// Bytes of what views see of volumes: 32 for every pixel in which a volume may be seen. `bytes` leaves them out, as
    /// [`VolumeBudget`](crate::volume::VolumeBudget) does.
    pub view_bytes: u64,
}

impl core::ops::Add for GpuUsage {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            textures: self.textures + other.textures,
            buffers: self.buffers + other.buffers,
            bytes: self.bytes + other.bytes,
            view_bytes: self.view_bytes + other.view_bytes,
        }
    }
}

/// Report of the render world to the main world.
#[derive(Default)]
pub(crate) struct Report {
    /// Placed volumes, and whether their occlusion is ready.
    pub ready: Vec<(Entity, bool)>,
    pub usage: GpuUsage,
    pub passes: PassLog,
    pub superbricks_tested: u64,
    pub plan_time: Duration,
    /// Layers that all carvers get together.
    pub layers_wanted: u32,
    /// Carvers whose meshes have more layers than they get.
    pub cut_off: Vec<ClipMeshCutOff>,
}

/// Times every pass by the clock while `true`, waiting for the GPU after each.
///
/// Waiting slows frames down. It is meant for drivers without timestamps, and for drivers whose timestamps say nothing
/// about compute passes (Mesa's software driver).
#[derive(Resource, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Resource, Default, Debug, Clone, PartialEq)]
pub struct TimePassesByClock(pub bool);

/// Passes that ran since the start, in the order of their first run. A frame at rest adds nothing.
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

    /// Number of carvers, volumes or views that the pass named `span` ran for since the start.
    pub fn jobs(&self, span: &str) -> u64 {
        self.runs(span).map_or(0, |runs| runs.jobs)
    }

    /// Milliseconds of the pass's last run, if timed by the clock.
    pub fn clock_ms(&self, span: &str) -> Option<f64> {
        self.runs(span)?.clock_ms
    }

    /// Number of jobs of all passes since the start.
    pub fn total_jobs(&self) -> u64 {
        self.0.iter().map(|runs| runs.jobs).sum()
    }

    fn runs(&self, span: &str) -> Option<&PassRuns> {
        self.0.iter().find(|runs| runs.span == span)
    }
}

/// Time that the CPU took in the last frame to decide which passes it needs, and to write their inputs.
// Not a resource of scenes: it is measured.
#[derive(Resource, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct PlanTime(pub Duration);

/// Connects the render world's [`Report`] with the main world.
#[derive(Resource, Clone, Default)]
pub(crate) struct ReportChannel(pub Arc<Mutex<Report>>);

/// Work done and resources held by the renderer.
#[derive(Resource, Clone, Debug, Default, PartialEq)]
pub struct RenderStatus {
    /// Resources on the GPU.
    pub usage: GpuUsage,
    /// Passes that ran.
    pub passes: PassLog,
    /// Layers of the depth maps of all carvers together.
    pub clip_layers: u32,
    /// Superbricks that the last frame with a change tested ([`ClipWork`]).
    pub superbricks_tested: u64,
}
