//! Time until a volume is shown with all its occlusion, and the memory that it takes.

use bevy::prelude::*;
use bevy_contextual_ao::prelude::*;
use std::time::Instant;

use super::recorder::Recorder;
use crate::{counts::bytes_per_voxel, stage::Stage};

/// Seconds after which a volume is given up.
const PATIENCE: f64 = 60.0;

/// Shows a volume in a new app, then another in the same app.
pub fn measure(record: &mut Recorder) -> Result<(), String> {
    let parts = record.shell(record.scale.voxels)?;
    let volume = parts.volume.clone();
    let case = "first volume of an app";
    let begin = Instant::now();
    let mut stage = record.stage(parts, record.scale.image);
    record.row(case, "start of the app", "ms", begin.elapsed().as_secs_f64() * 1e3);
    until_shown(&mut stage, case, record)?;
    memory(&stage, case, record);

    let entity = stage.scene.volume;
    stage.headless.app.world_mut().entity_mut(entity).remove::<Volume3d>();
    // Its memory is freed meanwhile.
    stage.headless.frames(3);
    let case = "another volume";
    let world = stage.headless.app.world_mut();
    let volume = world.resource_mut::<Assets<Volume>>().add(volume);
    world.entity_mut(entity).insert(Volume3d(volume));
    until_shown(&mut stage, case, record)?;
    memory(&stage, case, record);
    let bytes = bytes_per_voxel(&mut stage);
    record.row(case, "beyond intensities", "bytes a voxel", bytes);
    Ok(())
}

/// Runs frames until the volume's occlusion is ready.
fn until_shown(stage: &mut Stage, case: &str, record: &mut Recorder) -> Result<(), String> {
    let (begin, mut frames, mut longest) = (Instant::now(), 0, 0.0f64);
    loop {
        longest = longest.max(stage.frame_ms());
        frames += 1;
        let seconds = begin.elapsed().as_secs_f64();
        let ready = stage.headless.app.world().get::<OcclusionReady>(stage.scene.volume);
        if ready.is_some_and(|ready| ready.0) {
            record.row(case, "until its occlusion is ready", "ms", seconds * 1e3);
            record.row(case, "longest frame", "ms", longest);
            record.row(case, "frames", "", f64::from(frames));
            return Ok(());
        }
        if seconds > PATIENCE {
            return Err(format!("{case}: waited {seconds:.0} s in vain for its occlusion"));
        }
    }
}

fn memory(stage: &Stage, case: &str, record: &mut Recorder) {
    let usage = stage.usage();
    let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    record.row(case, "volumes and carvers", "MiB", mib(usage.bytes));
    record.row(case, "views", "MiB", mib(usage.view_bytes));
    record.row(case, "textures", "", usage.textures.into());
    record.row(case, "buffers", "", usage.buffers.into());
}
