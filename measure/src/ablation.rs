//! Effect of each optimization: carve frames with all of them, then without one at a time.

use bevy_contextual_ao::{diagnostics::Work, occlusion::Optimizations};
use contextual_ao_kit::mode::ShadingMode;
use serde_json::json;

use crate::{
    Options,
    counting::CountingScene,
    figures::{FrameTimes, merged},
    stage::Stage,
};
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
    let mut with_all = None;
    let all = options.with_published.then_some(("all", Optimizations::NONE));
    for (without, optimizations) in variants()?.into_iter().chain(all) {
        let found = measure(&mut stage, without, optimizations, options)?;
        let figures = json!({
            "without": without,
            "recast_voxels": found.work.voxels,
            "samples": found.work.samples,
            "distances": found.work.distances,
            "frames": found.frames,
            "ms_total_at_rest": found.rest.total,
            "pixels_different_from_with_all":
                with_all.as_deref().map(|with_all| different_pixels(&found.image, with_all)),
        });
        stage.print(merged(figures, found.times.to_json()));
        with_all.get_or_insert(found.image);
    }
    Ok(())
}

/// All optimizations, then all without one at a time. Each has the name of the one that is left out.
pub fn variants() -> Result<Vec<(&'static str, Optimizations)>, String> {
    let without = |name: &'static str| {
        let rest = Optimizations::default().without(name);
        // `sampleable` matters only without `demand`.
        let (title, rest) = match name {
            "sampleable" => ("demand, sampleable", rest.and_then(|rest| rest.without("demand"))),
            _ => (name, rest),
        };
        Ok((title, rest.ok_or_else(|| format!("there is no optimization `{name}`"))?))
    };
    let nothing = Ok(("nothing", Optimizations::default()));
    [nothing].into_iter().chain(Optimizations::names().map(without)).collect()
}

/// Measurements with some optimizations.
pub struct Ablated {
    /// Carve frames.
    pub times: FrameTimes,
    /// A frame in which nothing changed.
    pub rest: FrameTimes,
    /// Work of a carve frame.
    pub work: Work,
    /// Number of carve frames that were timed.
    pub frames: u32,
    /// Image of a carve frame.
    pub image: Vec<u8>,
}

/// Measures the scene with some optimizations. `without` names those left out.
pub fn measure(
    stage: &mut Stage,
    without: &str,
    optimizations: Optimizations,
    options: &Options,
) -> Result<Ablated, String> {
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
    Ok(Ablated { times, rest, work, frames, image })
}
