//! Times of carve frames beside those of a dense LAO as published, and the time that other carvers add.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{occlusion::Optimizations, volume::VolumeGeometry};
use contextual_ao_kit::mode::ShadingMode;
use serde_json::json;

use crate::{
    Options,
    counting::{CARVER, CountingScene, ball},
    figures::{FrameTimes, merged},
    stage::Stage,
};
use contextual_ao_kit::carver::Carver;

/// Times the opaque engine.
pub fn run(options: &Options) -> Result<(), String> {
    let Some(mut stage) = CountingScene::EngineOpaque.open(options)? else {
        return Ok(());
    };
    let [dense, published] = published(&mut stage, options.slow_frames)?;
    let ours = ours(&mut stage, options)?;
    for (case, times) in [("dense LAO, published", dense), ("CAO, published", published), ("CAO", ours)] {
        let ratios = json!({
            "case": case,
            "dense_over_clip_and_cast": dense.clip_and_cast() / times.clip_and_cast(),
            "dense_over_frame": dense.total / times.total,
        });
        stage.print(merged(ratios, times.to_json()));
    }
    at_rest(&mut stage, options);
    second_eye(&mut stage, options)?;
    more_carvers(&mut stage, options)
}

/// Times dense LAO and CAO, both without any optimization, with a carver at rest. So CAO casts the voxels within the
/// carver's reach, as published. A moving carver would add the voxels at its last place.
pub fn published(stage: &mut Stage, frames: u32) -> Result<[FrameTimes; 2], String> {
    let pattern = stage.rays().pattern;
    stage.prepare(ShadingMode::Solid, pattern)?;
    stage.set_optimizations(Optimizations::NONE);
    stage.set_mode(ShadingMode::Lao);
    let dense = stage.medians(0, frames, |_, _| {});
    stage.set_mode(ShadingMode::Cao);
    // The first frame casts all voxels.
    let contextual = stage.medians(1, frames, |_, _| {});
    stage.set_optimizations(Optimizations::default());
    Ok([dense, contextual])
}

/// Times CAO with all optimizations and a voxel of motion per frame.
pub fn ours(stage: &mut Stage, options: &Options) -> Result<FrameTimes, String> {
    stage.prepare(ShadingMode::Cao, stage.rays().pattern)?;
    Ok(stage.medians(options.warmup, options.frames, Stage::carve))
}

/// Times a camera that turns by a degree a frame: without occlusion, and with it.
pub fn turning(stage: &mut Stage, options: &Options) -> [FrameTimes; 2] {
    let times = [ShadingMode::Solid, ShadingMode::Cao].map(|mode| {
        stage.set_mode(mode);
        stage.medians(options.warmup, options.frames, |stage, frame| stage.turn_camera(frame as f32))
    });
    stage.turn_camera(0.0);
    times
}

/// Times frames in which no carver moves: with a camera that turns, beside the same without occlusion, and at rest.
fn at_rest(stage: &mut Stage, options: &Options) {
    let [drawn, turned] = turning(stage, options);
    let case = json!({ "case": "camera turns 1 degree, no occlusion" });
    stage.print(merged(case, drawn.to_json()));
    let ratio = turned.total / drawn.total;
    let case = json!({ "case": "camera turns 1 degree", "frame_over_drawing_alone": ratio });
    stage.print(merged(case, turned.to_json()));
    let rest = stage.medians(options.warmup, options.frames, |_, _| {});
    let jobs = stage.jobs_at_rest();
    stage.print(merged(json!({ "case": "at rest", "jobs": jobs }), rest.to_json()));
}

/// A change that is made before a frame.
type Change = fn(&mut Stage, u32);

/// Cases in which a second eye is timed, each with the change before a frame.
pub const EYE_CASES: [(&str, Change); 3] = [
    ("at rest", |_, _| {}),
    ("head turns", |stage, frame| stage.turn_camera(frame as f32)),
    (CARVING, Stage::carve),
];
/// Name of the case in which occlusion is cast for both eyes.
pub const CARVING: &str = "one carver moves";

/// Times one eye, and two eyes with a whole image each.
pub fn eyes(stage: &mut Stage, change: Change, options: &Options) -> Result<[FrameTimes; 2], String> {
    stage.prepare(ShadingMode::Cao, stage.rays().pattern)?;
    let one = stage.medians(options.warmup, options.frames, change);
    stage.open_second_eye();
    let both = stage.medians(options.warmup, options.frames, change);
    stage.close_second_eye();
    stage.turn_camera(0.0);
    Ok([one, both])
}

/// Times a second eye: at rest, while the head turns, and while a carver moves.
fn second_eye(stage: &mut Stage, options: &Options) -> Result<(), String> {
    for (case, change) in EYE_CASES {
        let [one, both] = eyes(stage, change, options)?;
        let ratio = json!({ "case": format!("two eyes, {case}"), "frame_over_one": both.total / one.total });
        stage.print(merged(ratio, both.to_json()));
    }
    Ok(())
}

/// Times the first carver beside carvers at rest: one opposite it, or 31 spread over the volume. The opposite carver
/// comes and goes, because a machine's speed varies by more than it adds.
fn more_carvers(stage: &mut Stage, options: &Options) -> Result<(), String> {
    const ROUNDS: usize = 5;
    let geometry = stage.scene.geometry;
    let second = [ball(&geometry, DVec3::ONE - CARVER, 0.14)];
    let (mut alone, mut beside) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        alone.push(ours(stage, options)?);
        beside.push(with(stage, &second, options)?);
    }
    let [one, two] = [alone, beside].map(|times| FrameTimes::medians(&times));
    let print = |stage: &Stage, carvers: u32, times: FrameTimes| {
        let ratios = json!({
            "case": "one carver moves",
            "carvers": carvers,
            "frame_over_one": times.total / one.total,
            "clip_and_cast_over_one": times.clip_and_cast() / one.clip_and_cast(),
        });
        stage.print(merged(ratios, times.to_json()));
    };
    print(stage, 1, one);
    print(stage, 2, two);
    let many = with(stage, &lattice(&geometry, DVec3::new(4.0, 4.0, 2.0), CARVER, 0.07), options)?;
    print(stage, 32, many);
    Ok(())
}

/// Balls of one radius in the cells of a lattice over the grid, except the cell of the carver at `first`.
pub fn lattice(geometry: &VolumeGeometry, cells: DVec3, first: DVec3, radius: f64) -> Vec<Carver> {
    let [x, y, z] = cells.to_array().map(|count| count as u32);
    let cell = |k: u32| DVec3::from([k % x, k / x % y, k / (x * y)].map(f64::from));
    let places = (0..x * y * z).map(|k| (cell(k) + 0.5) / cells);
    places
        .filter(|place| (place * cells).floor() != (first * cells).floor())
        .map(|place| ball(geometry, place, radius))
        .collect()
}

/// Times the first carver with another that overlaps it and moves with it.
pub fn with_overlapping(stage: &mut Stage, other: &Carver, options: &Options) -> Result<FrameTimes, String> {
    let joined = stage.join(other);
    let times = ours(stage, options);
    stage.leave(joined);
    times
}

/// Times the first carver with others beside it, at rest.
pub fn with(stage: &mut Stage, others: &[Carver], options: &Options) -> Result<FrameTimes, String> {
    let world = stage.headless.app.world_mut();
    let spawned: Vec<Entity> = others.iter().map(|carver| carver.spawn(world)).collect();
    let times = ours(stage, options);
    for carver in spawned {
        stage.headless.app.world_mut().despawn(carver);
    }
    times
}
