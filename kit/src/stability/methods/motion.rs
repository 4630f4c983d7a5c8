//! Figures of a method under changes: ghosts and lag after a carve, popping, flicker.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::prelude::*;

use crate::reach::reaching;

use super::floor::{Floor, Shown, cuboid, floor_points, nothing, rms};

/// Centre of a block that floats over the floor.
const BLOCK: DVec3 = DVec3::new(0.0, 0.0, 2.0);

fn block(p: DVec3) -> f64 {
    cuboid(p, BLOCK, DVec3::new(7.0, 7.0, 4.5))
}

/// Points of the floor in the block's shadow that the block does not hide from above.
fn beside() -> Vec<DVec3> {
    floor_points(8.0, 16.0).into_iter().filter(|p| p.x.abs().max(p.y.abs()) > 8.4).collect()
}

/// Half the size of a carver that contains the block and does not touch the floor.
const AROUND: DVec3 = DVec3::new(9.2, 9.2, 6.1);

/// Traces of a block that is carved away.
pub struct Ghost {
    /// RMS darkening of the floor by the block.
    pub shadow: f64,
    /// RMS difference from a floor that never had a block, in the frame of the carve.
    pub at_once: f64,
    /// The same difference when nothing changes any more.
    pub stays: f64,
    /// Frames from the first that shows the carve to the first that looks like the last.
    pub lag: u32,
}

/// Frames after which a method has converged.
const LONGEST_LAG: usize = 60;

/// Carves a block away and measures its traces.
pub fn ghost(occlusion: &AmbientOcclusion) -> Ghost {
    let points = floor_points(0.0, 15.0);
    let beside = beside();
    let mut bare = Floor::new(occlusion, &nothing, 0.0);
    // The bare floor has the same carver, which changes nothing there.
    bare.carve(BLOCK, AROUND);
    let bare = bare.shown();
    let mut floor = Floor::new(occlusion, &block, 0.0);
    let carver = floor.carve(DVec3::new(0.0, 0.0, 40.0), AROUND);
    let before = floor.shown();
    floor.move_carver(carver, BLOCK);
    let after: Vec<Shown> = (0..LONGEST_LAG).map(|_| floor.frame()).collect();
    let last = after[LONGEST_LAG - 1].at_all(&points);
    let truth = bare.at_all(&points);
    // Half a byte, of a factor in the middle of its range, is not visible.
    let is_there = |shown: &Shown| rms(&shown.at_all(&points), &last) < 0.002;
    Ghost {
        shadow: rms(&before.at_all(&beside), &bare.at_all(&beside)),
        at_once: rms(&after[0].at_all(&points), &truth),
        stays: rms(&last, &truth),
        lag: after.iter().position(is_there).unwrap_or(LONGEST_LAG) as u32,
    }
}

/// Largest step of the floor's shading over the mean step, while the reach grows steadily from 4 to 12 mm. `None` for
/// methods without such a setting.
pub fn pops(occlusion: &AmbientOcclusion) -> Option<f64> {
    const STEPS: u32 = 32;
    let points = beside();
    let mut floor = Floor::new(occlusion, &block, 0.0);
    let mut steps = Vec::new();
    let mut before: Option<Vec<f64>> = None;
    for k in 0..=STEPS {
        let reach_mm = 4.0 + 8.0 * k as f32 / STEPS as f32;
        floor.set_occlusion(reaching(occlusion, reach_mm, DVec3::ONE)?);
        let now = floor.shown().at_all(&points);
        steps.extend(before.map(|before| rms(&before, &now)));
        before = Some(now);
    }
    let largest = steps.iter().copied().fold(0.0, f64::max);
    Some(largest * steps.len() as f64 / steps.iter().sum::<f64>())
}

/// Flicker of the floor's shading around a block while a carver cuts into the block by 1/16 voxel a frame.
pub fn carver_flicker(occlusion: &AmbientOcclusion) -> f64 {
    let points = beside();
    let mut floor = Floor::new(occlusion, &block, 0.0);
    let place = |frame: u32| BLOCK + DVec3::new(-9.0 + f64::from(frame) / 16.0, 0.0, 0.0);
    let carver = floor.carve(place(0), AROUND);
    flicker((1..=24).map(|frame| {
        floor.move_carver(carver, place(frame));
        floor.frame().at_all(&points)
    }))
}

/// Flicker of the floor's shading while the camera turns by a quarter of a degree a frame.
pub fn camera_flicker(occlusion: &AmbientOcclusion) -> f64 {
    // These points are visible wherever the camera is.
    let points = floor_points(13.0, 17.0);
    let mut floor = Floor::new(occlusion, &block, 0.0);
    floor.look_tilted(-4.0);
    floor.settle();
    flicker((0..24).map(|frame| {
        floor.look_tilted(-4.0 + 0.25 * f64::from(frame));
        floor.frame().at_all(&points)
    }))
}

/// RMS of unsteady changes: second differences from frame to frame.
fn flicker(frames: impl Iterator<Item = Vec<f64>>) -> f64 {
    let frames: Vec<_> = frames.collect();
    let squares = frames.windows(3).flat_map(|three| {
        let each = three[0].iter().zip(&three[1]).zip(&three[2]);
        each.map(|((a, b), c)| (a - 2.0 * b + c).powi(2))
    });
    let squares: Vec<f64> = squares.collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}
