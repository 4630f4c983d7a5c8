//! Time that a distance field saves for view rays to an isosurface, as in the occlusion sweeping paper (section 3).

use bevy::prelude::*;
use bevy_contextual_ao::occlusion::Optimizations;
use bevy_contextual_ao::{
    occlusion::{OcclusionSweeping, SweepingSurface},
    prelude::*,
};
use contextual_ao_kit::mode::ShadingMode;
use serde_json::json;

use crate::{Options, counting::CountingScene, stage::Stage};

/// Prints a line per scene, for frames in which nothing changed. They are drawn by the transfer function, and by the
/// isosurface at half its opacity, step by step and leaping.
pub fn run(options: &Options) -> Result<(), String> {
    for scene in [CountingScene::EngineOpaque, CountingScene::CtHead] {
        let Some(parts) = scene.load(options)? else {
            continue;
        };
        let isovalue = parts.transfer_function.as_ref().and_then(TransferFunction::isovalue);
        let surface = SweepingSurface::Isosurface(isovalue.unwrap_or_default());
        let sweeping = OcclusionMethod::Sweeping(OcclusionSweeping { surface, ..default() });
        let mut stage = Stage::new(parts, options.image_size());
        let function = drawing_ms(&mut stage, &default(), true, options)?;
        let stepping = drawing_ms(&mut stage, &sweeping, false, options)?;
        let image = stage.image();
        let leaping = drawing_ms(&mut stage, &sweeping, true, options)?;
        let is_same = stage.image() == image;
        stage.print(json!({
            "frames": options.frames,
            "isovalue": isovalue,
            "ms_function": function,
            "ms_stepping": stepping,
            "ms_leaping": leaping,
            "leaping_over_stepping": leaping / stepping,
            "leaping_over_function": leaping / function,
            "same_image": is_same,
        }));
    }
    Ok(())
}

/// Median milliseconds of frames that draw the volume without occlusion and do nothing else.
fn drawing_ms(
    stage: &mut Stage,
    method: &OcclusionMethod,
    draw_leaps: bool,
    options: &Options,
) -> Result<f64, String> {
    stage.set_optimizations(Optimizations { draw_leaps, ..default() });
    let occlusion = AmbientOcclusion { method: method.clone(), ..stage.occlusion() };
    stage.prepare_with(ShadingMode::Solid, occlusion)?;
    Ok(stage.medians(options.warmup, options.frames, |_, _| {}).total)
}
