//! What `CastPacing` does to frame times and to the picture, in a generated volume: a ball carves, and now and then all that
//! is in view has to be cast.

use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_contextual_ao::{diagnostics::TimePassesByClock, prelude::*};
use contextual_ao_kit::{chart::rms, mode::ShadingMode};
use serde_json::json;
use std::time::Duration;

use crate::{Options, figures::median, shell, stage::Stage};

/// Voxels along each side of the volume.
const VOXELS: u32 = 128;
/// Jumps of each kind, in turns.
const JUMPS: u32 = 4;

/// A change after which all that is in view has to be cast.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// The camera shows another side: no voxel has a factor yet.
    Turn,
    /// The sky changes: voxels have the factors of the sky before.
    Edit,
}

/// Size of the carver over that in the scene of growing volumes: what a hand holds.
const CARVER_SCALE: f32 = 0.3;
/// Frames of steady carving before each jump.
const STEADY: u32 = 12;
/// Most frames that a jump may wait.
const MOST_FRAMES: usize = 400;
/// Target over the median frame of steady carving.
const TARGET_SHARE: f64 = 1.33;

/// Frames of steady carving and behind jumps.
#[derive(Default)]
struct Times {
    steady: Vec<f64>,
    jumps: Vec<f64>,
}

impl Times {
    fn longest(of: &[f64]) -> f64 {
        of.iter().copied().fold(0.0, f64::max)
    }
}

/// A jump while words wait.
struct Jump {
    frames: usize,
    /// Milliseconds of the first frame.
    first_ms: f64,
    first_error: Option<f64>,
    mean_error: Option<f64>,
}

/// Prints times with pacing and without it, and errors while words wait.
pub fn run(options: &Options) -> Result<(), String> {
    let mut free = prepared(None, options)?;
    let steady: Vec<_> = (0..3 * STEADY).map(|frame| steady_frame(&mut free, frame)).collect();
    // The first frames compile and learn.
    let target_ms = TARGET_SHARE * median(steady[STEADY as usize..].to_vec());
    let pacing = CastPacing { target_frame_ms: target_ms as f32, ..default() };
    let mut paced = prepared(Some(pacing), options)?;
    let mut times = [Times::default(), Times::default()];
    for kind in [Kind::Turn, Kind::Edit] {
        let mut jumps = Vec::new();
        for number in 1..=JUMPS {
            for frame in 0..STEADY {
                for (stage, times) in [&mut free, &mut paced].into_iter().zip(&mut times) {
                    times.steady.push(steady_frame(stage, frame));
                }
            }
            jumps.push(jump([&mut free, &mut paced], kind, number, &mut times));
        }
        let mean = |of: &dyn Fn(&Jump) -> Option<f64>| {
            let values: Vec<_> = jumps.iter().filter_map(of).collect();
            values.iter().sum::<f64>() / values.len() as f64
        };
        paced.print(json!({
            "jump": if kind == Kind::Turn { "another side" } else { "another sky" },
            "frames_until_complete": median(jumps.iter().map(|jump| jump.frames as f64).collect()),
            "rms_first_frame": mean(&|jump| jump.first_error),
            "rms_while_waiting": mean(&|jump| jump.mean_error),
            "longest_ms_without_and_with": times.each_ref().map(|times| Times::longest(&times.jumps)),
            "median_ms_without_and_with": times.each_ref().map(|times| median(times.jumps.clone())),
            "slow_frames_without_and_with":
                times.each_ref().map(|times| times.jumps.iter().filter(|ms| **ms > target_ms).count()),
            "first_frames_ms": jumps.iter().map(|jump| jump.first_ms).collect::<Vec<_>>(),
        }));
        times.iter_mut().for_each(|times| times.jumps.clear());
    }
    for (name, times) in ["without", "with"].into_iter().zip(&times) {
        paced.print(json!({
            "pacing": name,
            "target_ms": target_ms,
            "least_words_per_frame": pacing.least_words_per_frame,
            "steady_median_ms": median(times.steady.clone()),
            "steady_longest_ms": Times::longest(&times.steady),
        }));
    }
    Ok(())
}

fn prepared(pacing: Option<CastPacing>, options: &Options) -> Result<Stage, String> {
    let mut stage = Stage::new(shell::carved(shell::generate(VOXELS)?)?, options.image_size());
    stage.scale_carver(CARVER_SCALE);
    let world = stage.headless.app.world_mut();
    world.insert_resource(TimePassesByClock(false));
    if let Some(pacing) = pacing {
        world.insert_resource(pacing);
    }
    stage.prepare(ShadingMode::Cao, Quality::High.rays().pattern)?;
    stage.headless.frames(12);
    Ok(stage)
}

/// Milliseconds of a frame. What is done between frames, such as reading images, does not count for the next one.
fn timed_frame(stage: &mut Stage) -> f64 {
    let ms = stage.frame_ms();
    let frame = TimeUpdateStrategy::ManualDuration(Duration::from_secs_f64(1e-3 * ms));
    stage.headless.app.insert_resource(frame);
    ms
}

fn steady_frame(stage: &mut Stage, frame: u32) -> f64 {
    stage.carve(frame);
    timed_frame(stage)
}

/// Changes what both stages show, and runs frames of the second until it shows what the first one shows at once.
fn jump([free, paced]: [&mut Stage; 2], kind: Kind, number: u32, times: &mut [Times; 2]) -> Jump {
    for stage in [&mut *free, &mut *paced] {
        if kind == Kind::Turn {
            stage.turn_camera(360.0 / JUMPS as f32 * number as f32 - 20.0);
        } else {
            let sky = if number % 2 == 1 { Sky::above(Vec3::Y) } else { Sky::default() };
            let occlusion = AmbientOcclusion { sky, ..stage.occlusion() };
            let volume = stage.scene.volume;
            stage.headless.app.world_mut().entity_mut(volume).insert(occlusion);
        }
    }
    times[0].jumps.push(timed_frame(free));
    let exact = free.headless.image();
    let (mut errors, first) = (Vec::new(), times[1].jumps.len());
    loop {
        times[1].jumps.push(timed_frame(paced));
        let image = paced.headless.image();
        if image == exact || errors.len() == MOST_FRAMES {
            break;
        }
        errors.push(error(&image, &exact));
    }
    let mean = errors.iter().flatten().sum::<f64>() / errors.len().max(1) as f64;
    Jump {
        frames: errors.len() + 1,
        first_ms: times[1].jumps[first],
        first_error: errors.first().copied().flatten(),
        mean_error: (!errors.is_empty()).then_some(mean),
    }
}

/// RMS error over the object's pixels, as a share of the full range.
fn error(image: &[u8], exact: &[u8]) -> Option<f64> {
    let background = &exact[..4];
    let pixels = image.chunks(4).zip(exact.chunks(4)).filter(|(_, exact)| *exact != background);
    let bytes = pixels.flat_map(|(image, exact)| image[..3].iter().zip(&exact[..3]));
    rms(bytes.map(|(image, exact)| (f64::from(*image) - f64::from(*exact)) / 255.0)).0
}
