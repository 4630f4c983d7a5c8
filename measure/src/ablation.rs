//! Effect of each optimization: carve frames with all of them, then without one at a time.

use bevy_contextual_ao::occlusion::Optimizations;
use contextual_ao_kit::mode::ShadingMode;
use serde_json::json;

use crate::{Options, counting::CountingScene, figures::merged, stage::Stage};
use contextual_ao_kit::headless::different_pixels;

/// Measures the scene of the command line if it has a volume, else the opaque engine.
pub fn run(options: &Options) -> Result<(), String> {
    let stage = if options.scene.volume.is_some() {
        Some(Stage::new(options.scene.parts()?, options.scene.size))
    } else {
        CountingScene::EngineOpaque.open(options)?
    };
    let Some(mut stage) = stage else {
        return Ok(());
    };
    if stage.scene.carvers.is_empty() {
        return Err("--carver is missing: there would be nothing to measure".into());
    }
    let image = measure(&mut stage, "nothing", Optimizations::default(), None, options)?;
    for name in Optimizations::names() {
        let optimizations = Optimizations::default().without(name);
        // `sampleable` matters only without `demand`.
        let (name, optimizations) = match name {
            "sampleable" => ("demand, sampleable", optimizations.and_then(|rest| rest.without("demand"))),
            _ => (name, optimizations),
        };
        let optimizations = optimizations.ok_or_else(|| format!("there is no optimization `{name}`"))?;
        measure(&mut stage, name, optimizations, Some(&image), options)?;
    }
    if options.with_published {
        measure(&mut stage, "all", Optimizations::NONE, Some(&image), options)?;
    }
    Ok(())
}

/// Prints the figures without some optimizations, and returns the image.
fn measure(
    stage: &mut Stage,
    without: &str,
    optimizations: Optimizations,
    with_all: Option<&[u8]>,
    options: &Options,
) -> Result<Vec<u8>, String> {
    stage.prepare(ShadingMode::Cao, stage.rays().pattern)?;
    stage.set_optimizations(optimizations);
    stage.carve(0);
    let frames = if without == "all" { options.slow_frames } else { options.frames };
    // Without `demand` the first frame casts all voxels.
    let times = stage.medians(options.warmup.max(1), frames, Stage::carve);
    let rest = stage.medians(0, 1, |_, _| {});
    stage.carve(0);
    let image = stage.image();
    let work = stage.count(|stage| stage.carve(1));
    stage.set_optimizations(Optimizations::default());
    let figures = json!({
        "without": without,
        "recast_voxels": work.voxels,
        "samples": work.samples,
        "distances": work.distances,
        "frames": frames,
        "ms_total_at_rest": rest.total,
        "pixels_different_from_with_all": with_all.map(|with_all| different_pixels(&image, with_all)),
    });
    stage.print(merged(figures, times.to_json()));
    Ok(image)
}
