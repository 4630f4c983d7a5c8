//! Counted work of a carve frame, beside that of the published pipeline.

use bevy::prelude::*;
use bevy_contextual_ao::occlusion::Optimizations;
use bevy_contextual_ao::{
    diagnostics::{RenderStatus, Work},
    prelude::*,
    volume::Intensities,
};
use clap::ValueEnum;
use contextual_ao_kit::mode::ShadingMode;
use serde_json::json;

use crate::{Options, counting::CountingScene, figures::ratio, stage::Stage};
use contextual_ao_kit::headless::different_pixels;

/// Number of frames in which the carver comes to its place.
const APPROACH: u32 = 4;

/// Counts the work in one scene, or in all scenes.
pub fn run(only: Option<CountingScene>, options: &Options) -> Result<(), String> {
    for scene in CountingScene::value_variants().iter().filter(|scene| only.is_none_or(|o| o == **scene)) {
        if let Some(mut stage) = scene.open(options)? {
            count(&mut stage, options)?;
        }
    }
    Ok(())
}

fn count(stage: &mut Stage, options: &Options) -> Result<(), String> {
    let OcclusionRays { pattern, steps, .. } = stage.rays();
    let rays = u64::from(pattern.rays());
    let dense = stage.dense_samples();
    let published = published_voxels(stage)?;
    let published_samples = published * rays * u64::from(steps);

    stage.carve(APPROACH);
    stage.prepare(ShadingMode::Cao, pattern)?;
    for frame in (1..APPROACH).rev() {
        stage.carve(frame);
        stage.headless.frame();
    }
    let ours = stage.count(|stage| stage.carve(0));
    let image = stage.image();
    let jobs_at_rest = stage.jobs_at_rest();
    let turned = stage.count(|stage| stage.turn_camera(1.0));
    stage.turn_camera(0.0);
    let different = (!options.no_check).then(|| different_pixels(&image, &stage.lao_image()));
    let edited = count_edit(stage);
    let bytes = bytes_per_voxel(stage);
    stage.print(json!({
        "published_voxels": published,
        "published_share_of_voxels": ratio(published, stage.scene.voxels),
        "published_samples": published_samples,
        "recast_voxels": ours.voxels,
        "samples": ours.samples,
        "distances": ours.distances,
        "published_over_ours": ratio(published_samples, ours.samples),
        "share_of_dense_lao": ratio(ours.samples, dense),
        "pixels_different_from_lao": different,
        "edit_samples": edited.samples,
        "edit_share_of_dense_lao": ratio(edited.samples, dense),
        "camera_voxels": turned.voxels,
        "camera_samples": turned.samples,
        "camera_share_of_dense_lao": ratio(turned.samples, dense),
        "jobs_at_rest": jobs_at_rest,
        "bytes_per_voxel_beyond_intensities": bytes,
    }));
    Ok(())
}

/// Voxels that the published pipeline casts in a carve frame: all that are visible and within reach of the carver.
/// Without optimizations a frame casts them even if the carver is at rest. A carver that moves also has the voxels at
/// its last place cast, as its occlusion is not kept twice.
///
/// One ray finds the same voxels as many rays. All rays are cast in full: samples are rays times steps.
pub fn published_voxels(stage: &mut Stage) -> Result<u64, String> {
    let steps = u64::from(stage.rays().steps);
    stage.prepare(ShadingMode::Solid, RayPattern::Fibonacci(1))?;
    stage.set_optimizations(Optimizations::NONE);
    stage.set_mode(ShadingMode::Cao);
    // The first frame casts all voxels.
    stage.headless.frame();
    let work = stage.count(|_| {});
    stage.set_optimizations(Optimizations::default());
    if work.samples == work.voxels * steps {
        Ok(work.voxels)
    } else {
        Err(format!("{} voxels of {steps} samples each took {}", work.voxels, work.samples))
    }
}

/// Counts the work after a slight edit of the transfer function: all occlusion is invalid.
pub fn count_edit(stage: &mut Stage) -> Work {
    stage.count(|stage| stage.edit_transfer_function(0.01))
}

/// Bytes per voxel on the device that go away with the volume, without its intensities.
pub fn bytes_per_voxel(stage: &mut Stage) -> f64 {
    let entity = stage.scene.volume;
    let bytes = |stage: &Stage| stage.headless.app.world().resource::<RenderStatus>().usage.bytes;
    let with_volume = bytes(stage);
    let world = stage.headless.app.world_mut();
    let volume = world.entity_mut(entity).take::<Volume3d>().unwrap_or_default();
    // The carver's maps stay.
    stage.headless.frames(3);
    let bytes = with_volume - bytes(stage);
    let volumes = stage.headless.app.world().resource::<Assets<Volume>>();
    let bits_8 = volumes.get(&volume.0).is_some_and(|v| matches!(v.intensities(), Intensities::U8(_)));
    bytes as f64 / stage.scene.voxels as f64 - if bits_8 { 1.0 } else { 2.0 }
}
