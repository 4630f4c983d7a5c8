//! Times of carve frames beside those of a dense LAO as published, and the time that other carvers add.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::occlusion::Optimizations;
use bevy_contextual_ao::volume::{VolumeGeometry, WORLD_UNITS_PER_MM};
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

/// Times frames in which no carver moves: with a camera that turns, beside the same without occlusion, and at rest.
fn at_rest(stage: &mut Stage, options: &Options) {
    let turning = |stage: &mut Stage, frame: u32| stage.turn_camera(frame as f32);
    stage.set_mode(ShadingMode::Solid);
    let drawn = stage.medians(options.warmup, options.frames, turning);
    stage.set_mode(ShadingMode::Cao);
    let turned = stage.medians(options.warmup, options.frames, turning);
    let case = json!({ "case": "camera turns 1 degree, no occlusion" });
    stage.print(merged(case, drawn.to_json()));
    let ratio = turned.total / drawn.total;
    let case = json!({ "case": "camera turns 1 degree", "frame_over_drawing_alone": ratio });
    stage.print(merged(case, turned.to_json()));
    stage.turn_camera(0.0);
    let rest = stage.medians(options.warmup, options.frames, |_, _| {});
    let jobs = stage.jobs_at_rest();
    stage.print(merged(json!({ "case": "at rest", "jobs": jobs }), rest.to_json()));
}

/// Times a second eye, a whole image beside the first: at rest, while the head turns, and while a carver moves.
fn second_eye(stage: &mut Stage, options: &Options) -> Result<(), String> {
    const APART_MM: f32 = 63.0;
    let eye = stage.scene.view;
    let right = eye.right() * APART_MM * WORLD_UNITS_PER_MM;
    let second = eye.with_translation(eye.translation + right);
    type Change = fn(&mut Stage, u32);
    let changes: [(&str, Change); 3] = [
        ("at rest", |_, _| {}),
        ("head turns", |stage, frame| stage.turn_camera(frame as f32)),
        ("one carver moves", Stage::carve),
    ];
    for (case, change) in changes {
        stage.prepare(ShadingMode::Cao, stage.rays().pattern)?;
        let one = stage.medians(options.warmup, options.frames, change);
        let camera = (stage.headless.camera(), stage.projection());
        let world = stage.headless.app.world_mut();
        let order = Camera { order: 1, ..default() };
        let camera = world.spawn(camera).insert((order, second)).id();
        let both = stage.medians(options.warmup, options.frames, |stage, frame| {
            change(stage, frame);
            if case == "head turns" {
                let turn = Transform::from_rotation(Quat::from_rotation_y((frame as f32).to_radians()));
                stage.headless.app.world_mut().entity_mut(camera).insert(turn * second);
            }
        });
        stage.headless.app.world_mut().despawn(camera);
        stage.turn_camera(0.0);
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
    let many = with(stage, &lattice(&geometry), options)?;
    print(stage, 32, many);
    Ok(())
}

/// Small balls in the cells of a lattice over the grid, except the first carver's cell: 31 balls.
fn lattice(geometry: &VolumeGeometry) -> Vec<Carver> {
    let cells = DVec3::new(4.0, 4.0, 2.0);
    let places = (0..32).map(|k| (DVec3::from([k % 4, k / 4 % 4, k / 16].map(f64::from)) + 0.5) / cells);
    places
        .filter(|place| (place * cells).floor() != (CARVER * cells).floor())
        .map(|place| ball(geometry, place, 0.07))
        .collect()
}

/// Times the first carver with others beside it.
pub fn with(stage: &mut Stage, others: &[Carver], options: &Options) -> Result<FrameTimes, String> {
    let world = stage.headless.app.world_mut();
    let spawned: Vec<Entity> = others.iter().map(|carver| carver.spawn(world)).collect();
    let times = ours(stage, options);
    for carver in spawned {
        stage.headless.app.world_mut().despawn(carver);
    }
    times
}
