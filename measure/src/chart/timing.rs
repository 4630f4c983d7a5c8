//! Times each setting. Settings take turns, round by round, because a machine's speed varies.

use bevy_contextual_ao::diagnostics::TimePassesByClock;
use bevy_contextual_ao::occlusion::Optimizations;
use contextual_ao_kit::mode::ShadingMode;
use std::time::Instant;

use super::methods::{DENSE, SOLID, Setting};
use crate::{figures::median, stage::Stage};

/// Time for a setting. Slow settings are timed as often as fits into it, all at least once.
const SECONDS_PER_SETTING: f64 = 3.0;
/// Number of rounds in which the unit of time is measured, however long they take.
const DENSE_ROUNDS: usize = 3;
/// Shift of the transfer function's first point, in the file's units.
const EDIT: f32 = 0.01;

/// Median milliseconds of all kinds of frames, and the number of frames behind each median.
#[derive(Clone, Copy)]
pub struct Timed {
    pub ms: [f64; 3],
    pub frames: u32,
}

/// Times all settings in up to `rounds` rounds.
pub fn time(stage: &mut Stage, settings: &[Setting], rounds: u32) -> Result<Vec<Timed>, String> {
    // Waiting for each pass slows frames down.
    stage.headless.app.insert_resource(TimePassesByClock(false));
    let mut visits = vec![Vec::<[f64; 3]>::new(); settings.len()];
    let mut seconds = vec![0.0; settings.len()];
    for round in 0..rounds as usize {
        for (index, setting) in settings.iter().enumerate() {
            let a_visit = seconds[index] / visits[index].len().max(1) as f64;
            let is_needed = round == 0 || setting.is_dense_unit() && round < DENSE_ROUNDS;
            if is_needed || seconds[index] + a_visit <= SECONDS_PER_SETTING {
                let begin = Instant::now();
                visits[index].push(visit(stage, setting)?);
                seconds[index] += begin.elapsed().as_secs_f64();
            }
        }
    }
    let medians = |visits: &Vec<[f64; 3]>| Timed {
        ms: [0, 1, 2].map(|kind| median(visits.iter().map(|ms| ms[kind]).collect())),
        frames: visits.len() as u32,
    };
    stage.set_optimizations(Optimizations::default());
    stage.set_view_samples(None);
    Ok(visits.iter().map(medians).collect())
}

/// Times a frame of each kind.
fn visit(stage: &mut Stage, setting: &Setting) -> Result<[f64; 3], String> {
    stage.set_optimizations(Optimizations::default());
    stage.carve(0);
    stage.set_view_samples(setting.view_samples);
    stage.prepare_with(setting.mode, setting.occlusion.clone())?;
    stage.headless.frames(setting.frames_to_settle());
    // A setting without optimizations casts all voxels in its first frame, and in every frame that prepares it.
    stage.set_optimizations(setting.optimizations);
    if setting.mode.recomputes_all() {
        // Every frame recomputes everything, whatever changed.
        stage.carve(2);
        return Ok([stage.frame_ms(); 3]);
    }
    stage.carve(1);
    stage.headless.frame();
    stage.carve(2);
    let carve = stage.frame_ms();
    stage.headless.frames(setting.frames_to_settle());
    let rest = stage.frame_ms();
    stage.edit_transfer_function(EDIT);
    let edit = stage.frame_ms();
    stage.set_mode(ShadingMode::Solid);
    stage.edit_transfer_function(-EDIT);
    Ok([carve, rest, edit])
}

impl Setting {
    /// Whether the setting's carve frame is the unit of time.
    pub fn is_dense_unit(&self) -> bool {
        (self.family, self.label.as_str()) == DENSE
    }

    /// Whether nothing but clipping is computed.
    pub fn is_solid(&self) -> bool {
        self.family == SOLID
    }
}
