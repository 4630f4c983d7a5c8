//! What a user can read about the work done: names of the passes' timings and work counters.
//!
//! Timings need Bevy's `RenderDiagnosticsPlugin`; they appear in the `DiagnosticsStore` as
//! milliseconds, under the paths given here.

use bevy::{
    diagnostic::{DiagnosticPath, DiagnosticsStore},
    prelude::*,
};
use std::sync::{Arc, Mutex};

/// Rendering the depth maps of carvers that changed (step II).
pub const SPAN_DEPTH: &str = "contextual_ao/clip_depth";
/// Computing the dilation maps of carvers that changed (step III).
pub const SPAN_DILATE: &str = "contextual_ao/dilate";
/// Clipping the voxels (step IV).
pub const SPAN_CLASSIFY: &str = "contextual_ao/classify";
/// Casting rays of the unclipped volume (step I).
pub const SPAN_PRECOMPUTE: &str = "contextual_ao/precompute";
/// Casting rays of voxels affected by clipping (step V).
pub const SPAN_RAY_CAST: &str = "contextual_ao/ray_cast";
/// All passes before drawing.
pub const SPANS: [&str; 5] = [
    SPAN_DEPTH,
    SPAN_DILATE,
    SPAN_CLASSIFY,
    SPAN_PRECOMPUTE,
    SPAN_RAY_CAST,
];
/// Bevy's span in which volumes are drawn, with everything else that is transparent.
pub const SPAN_DRAW: &str = "main_transparent_pass_3d";

/// Names of the work counters: low and high 32 bits of voxels cast, then of samples taken.
pub(crate) const COUNTERS: [&str; 4] = [
    "contextual_ao/voxels_low",
    "contextual_ao/voxels_high",
    "contextual_ao/samples_low",
    "contextual_ao/samples_high",
];

/// Counts the ray cast's work on the GPU while `true`. Counting slows the ray cast down.
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
    /// Bytes in them, as their formats count.
    pub bytes: u64,
}

/// What the render world reports to the main world.
#[derive(Default)]
pub(crate) struct Report {
    pub progress: Vec<(Entity, f32)>,
    pub usage: GpuUsage,
    /// Frames, per kind of pass, in which it ran since the start.
    pub passes: PassCounts,
}

/// How often each kind of pass ran since the start; a frame at rest adds nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PassCounts {
    /// Carvers whose depth maps were rendered.
    pub depth_maps: u64,
    /// Carvers whose dilation maps were computed.
    pub dilations: u64,
    /// Volumes whose voxels were clipped.
    pub classifications: u64,
    /// Portions of unclipped occlusion computed.
    pub precomputations: u64,
    /// Volumes whose occlusion was cast.
    pub ray_casts: u64,
}

/// Connects the render world's [`Report`] with the main world.
#[derive(Resource, Clone, Default)]
pub(crate) struct ReportChannel(pub Arc<Mutex<Report>>);

/// What the renderer did and holds.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RenderStatus {
    /// What is allocated.
    pub usage: GpuUsage,
    /// What has run.
    pub passes: PassCounts,
}
