//! Table 1 of the CAO paper with measured columns: the frame after the radius, the transfer function or the carver changed,
//! by every method. The paper says which of these changes are live.

use bevy_contextual_ao::{
    diagnostics::TimePassesByClock,
    occlusion::{
        DirectionalOcclusion, OcclusionFiltering, OcclusionSweeping, Optimizations, ScreenSpaceOcclusion,
        SummedAreaOcclusion,
    },
    prelude::*,
};
use contextual_ao_kit::{mode::ShadingMode, reach::reaching};

use crate::{
    Options,
    chart::scenes::{halvings, image_size},
    counting::CountingScene,
    figures::median,
    stage::Stage,
    tables::print_table,
};

/// Shift of the transfer function's first point, in the file's units.
const EDIT: f32 = 0.01;
/// Share by which the radius changes.
const CHANGE: f32 = 0.1;

/// A method of the table.
struct Case {
    name: &'static str,
    /// Its verdicts on changes of the radius, the transfer function and clipping, if it is in the paper's table.
    paper: &'static str,
    mode: ShadingMode,
    optimizations: Optimizations,
    occlusion: AmbientOcclusion,
}

/// Prints the table for the opaque engine. Times are over that of a frame without occlusion in which the carver moves.
pub fn run(options: &Options) -> Result<(), String> {
    // As on the chart: a dense LAO of the whole volume takes minutes.
    let Some(parts) = CountingScene::EngineOpaque.load_halved(halvings(options))? else {
        return Ok(());
    };
    let mut stage = Stage::new(parts, image_size(options));
    // Waiting for each pass slows frames down.
    stage.headless.app.insert_resource(TimePassesByClock(false));
    let reach_mm = stage.rays().steps as f32 * stage.rays().step_mm.unwrap_or(stage.scene.voxel_mm);
    let occlusion = stage.occlusion();
    stage.prepare_with(ShadingMode::Solid, occlusion)?;
    let frames = options.frames.max(3);
    let unit = median((1..=frames).map(|frame| after_carve(&mut stage, frame)).collect());
    let mut lines = Vec::new();
    for case in cases(&stage, reach_mm) {
        let [radius, table, carve] = times(&mut stage, &case, reach_mm, frames)?;
        let cell = |ms: Option<f64>| ms.map_or_else(|| "-".to_owned(), |ms| format!("{:.2}", ms / unit));
        let cells = [case.name.to_owned(), case.paper.to_owned(), cell(radius), cell(table), cell(carve)];
        lines.push(cells.to_vec());
    }
    let head = ["method", "paper: radius, TF, clipping", "radius", "TF", "clipping"];
    print_table("Table 1: time of the frame after a change, over that without occlusion", head, lines);
    println!("without occlusion: {unit:.1} ms, {frames} frames each");
    Ok(())
}

fn cases(stage: &Stage, reach_mm: f32) -> Vec<Case> {
    let radius_mm = Some(0.5 * reach_mm);
    let case = |name, paper, occlusion: AmbientOcclusion| Case {
        name,
        paper,
        mode: ShadingMode::Cao,
        optimizations: Optimizations::default(),
        occlusion,
    };
    let paper_rays = OcclusionRays { pattern: RayPattern::Rubik54, ..stage.rays() };
    let rays = OcclusionRays { pattern: RayPattern::default(), ..paper_rays };
    let boxes = |shells| AmbientOcclusion::by(SummedAreaOcclusion { radius_mm, shells });
    vec![
        Case {
            mode: ShadingMode::Lao,
            optimizations: Optimizations::NONE,
            ..case("LAO, 54 rays", "yes, no, no", AmbientOcclusion::by(paper_rays))
        },
        Case {
            optimizations: Optimizations::NONE,
            ..case("CAO as published, 54 rays", "no, no, yes", AmbientOcclusion::by(paper_rays))
        },
        case("CAO, 36 rays", "", AmbientOcclusion::by(rays)),
        case("SAT", "yes, no, no", boxes(1)),
        case("shelled SAT", "yes, no, no", boxes(5)),
        case("filtering", "", AmbientOcclusion::by(OcclusionFiltering { radius_mm, ..Default::default() })),
        case("sweeping", "", AmbientOcclusion::by(OcclusionSweeping::default())),
        case(
            "screen space",
            "",
            AmbientOcclusion::by(ScreenSpaceOcclusion { radius_mm, ..Default::default() }),
        ),
        case("directional", "", AmbientOcclusion::by(DirectionalOcclusion::default())),
    ]
}

/// Medians of the frames after changes of the radius, of the transfer function and of the carver. `None` without a radius.
fn times(stage: &mut Stage, case: &Case, reach_mm: f32, frames: u32) -> Result<[Option<f64>; 3], String> {
    stage.set_optimizations(Optimizations::default());
    stage.carve(0);
    stage.prepare_with(case.mode, case.occlusion.clone())?;
    // Without optimizations the first frame casts all voxels.
    stage.set_optimizations(case.optimizations);
    stage.headless.frame();
    let spacing_mm = stage.scene.geometry.spacing_mm;
    let mut radius = Vec::new();
    for frame in 0..frames {
        let share = if frame % 2 == 0 { 1.0 + CHANGE } else { 1.0 };
        if let Some(changed) = reaching(&case.occlusion, share * reach_mm, spacing_mm) {
            let volume = stage.scene.volume;
            stage.headless.app.world_mut().entity_mut(volume).insert(changed);
            radius.push(stage.frame_ms());
        }
    }
    let table = (0..frames).map(|frame| {
        stage.edit_transfer_function(if frame % 2 == 0 { EDIT } else { -EDIT });
        stage.frame_ms()
    });
    let table = median(table.collect());
    let carve = median((1..=frames).map(|frame| after_carve(stage, frame)).collect());
    stage.set_optimizations(Optimizations::default());
    Ok([(!radius.is_empty()).then(|| median(radius)), Some(table), Some(carve)])
}

/// Milliseconds of a frame in which the carver moves by a voxel.
fn after_carve(stage: &mut Stage, frame: u32) -> f64 {
    stage.carve(frame);
    stage.frame_ms()
}
