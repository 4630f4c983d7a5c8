//! Carves the scene of the command line: a line per shading mode and ray pattern.

use crate::{Options, figures::merged, stage::Stage};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::headless::different_pixels;
use contextual_ao_kit::mode::ShadingMode;
use serde_json::json;

/// Measures every mode with every pattern.
pub fn run(options: &Options) -> Result<(), String> {
    let parts = options.scene.parts()?;
    if parts.carvers.is_empty() {
        return Err("--carver is missing: there would be nothing to measure".into());
    }
    let mut stage = Stage::new(parts, options.scene.size);
    stage.set_optimizations(options.scene.optimizations()?);
    for &pattern in &options.patterns {
        for &mode in &options.modes {
            measure(&mut stage, mode, pattern, options)?;
        }
    }
    Ok(())
}

fn measure(
    stage: &mut Stage,
    mode: ShadingMode,
    pattern: RayPattern,
    options: &Options,
) -> Result<(), String> {
    stage.prepare(mode, pattern)?;
    let times = stage.medians(options.warmup, options.frames, Stage::carve);
    // One more carve frame, counted by itself.
    let work = stage.count(|stage| stage.carve(options.warmup + options.frames));
    let different = (mode.uses_occlusion() && !mode.uses_light() && !options.no_check)
        .then(|| different_pixels(&stage.image(), &stage.lao_image()));
    stage.carve(0);
    let figures = json!({
        "mode": mode.name(),
        "recast_voxels": work.voxels,
        "samples": work.samples,
        "distances": work.distances,
        "frames": options.frames,
        "pixels_different_from_lao": different,
    });
    stage.print(merged(figures, times.to_json()));
    Ok(())
}
