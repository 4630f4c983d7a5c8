//! Times each setting. Settings take turns, round by round, because a machine's speed varies.

use bevy_contextual_ao::diagnostics::TimePassesByClock;
use bevy_contextual_ao::occlusion::Optimizations;
use contextual_ao_kit::mode::ShadingMode;
use std::time::Instant;

use super::methods::{DENSE, SOLID, Setting};
use crate::{figures::quantile, stage::Stage};

/// Number of rounds in which all settings are timed, however long they take.
const LEAST_ROUNDS: usize = 10;
/// Time for a setting after these rounds.
const SECONDS_PER_SETTING: f64 = 3.0;
/// Shift of the transfer function's first point, in the file's units.
const EDIT: f32 = 0.01;

/// Median milliseconds of all kinds of frames with their quartiles, and the number of frames behind each median.
#[derive(Clone, Copy)]
pub struct Timed {
    pub ms: [f64; 3],
    pub quartiles_ms: [[f64; 2]; 3],
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
            if round < LEAST_ROUNDS || seconds[index] + a_visit <= SECONDS_PER_SETTING {
                let begin = Instant::now();
                if setting.frames_of_motion() == 0 {
                    visits[index].push(visit(stage, setting)?);
                } else if round == 0 {
                    visits[index] = long_visit(stage, setting)?;
                }
                seconds[index] += begin.elapsed().as_secs_f64();
            }
        }
    }
    let medians = |visits: &Vec<[f64; 3]>| {
        let of = |share| [0, 1, 2].map(|kind| quantile(visits.iter().map(|ms| ms[kind]).collect(), share));
        let (lower, upper) = (of(0.25), of(0.75));
        let quartiles_ms = [0, 1, 2].map(|kind| [lower[kind], upper[kind]]);
        Timed { ms: of(0.5), quartiles_ms, frames: visits.len() as u32 }
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
    let rest = stage.frame_ms();
    stage.edit_transfer_function(EDIT);
    let edit = stage.frame_ms();
    stage.set_mode(ShadingMode::Solid);
    stage.edit_transfer_function(-EDIT);
    Ok([carve, rest, edit])
}

/// Times the frames of all rounds at once, for a setting that takes many frames to settle.
fn long_visit(stage: &mut Stage, setting: &Setting) -> Result<Vec<[f64; 3]>, String> {
    stage.set_optimizations(setting.optimizations);
    stage.set_view_samples(setting.view_samples);
    stage.carve(0);
    stage.prepare_with(setting.mode, setting.occlusion.clone())?;
    stage.headless.frames(setting.frames_of_motion());
    // The first frames of motion touch fewer voxels than later ones.
    let moving = 1..=LEAST_ROUNDS as u32;
    let carve: Vec<f64> = moving
        .map(|frame| {
            stage.carve(frame);
            stage.frame_ms()
        })
        .collect();
    stage.headless.frames(setting.frames_of_motion());
    let rest: Vec<f64> = carve.iter().map(|_| stage.frame_ms()).collect();
    let edits = (0..carve.len()).map(|k| if k % 2 == 0 { EDIT } else { -EDIT });
    let edit: Vec<f64> = edits
        .map(|by| {
            stage.edit_transfer_function(by);
            stage.frame_ms()
        })
        .collect();
    Ok((0..carve.len()).map(|k| [carve[k], rest[k], edit[k]]).collect())
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
