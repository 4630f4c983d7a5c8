//! Distance of view samples while something moves.

use bevy::prelude::*;

use super::{MotionQuality, step_control::StepControl};

/// View samples of a volume with [`MotionQuality`].
#[derive(Component, Clone, Debug, Default)]
pub(crate) struct MotionSampling {
    /// Fingerprint of all places in the previous frame.
    places: Option<u64>,
    is_in_motion: bool,
    /// Seconds since the last motion.
    rest_s: f32,
    control: StepControl,
}

impl MotionSampling {
    /// Distance of samples in this frame, voxels; `None` for the volume's own.
    pub fn step_voxels(&self) -> Option<f32> {
        self.is_in_motion.then_some(self.control.step_voxels)
    }

    /// Takes note of a frame: a fingerprint of all places, the volume's own distance of samples, and the time since the
    /// previous frame.
    pub fn follow(&mut self, places: u64, quality: &MotionQuality, full_voxels: f32, frame_s: f32) {
        let has_moved = self.places.replace(places).is_some_and(|before| before != places);
        let floor_voxels = quality.lowest.shading().step_voxels;
        if !has_moved {
            self.rest_s += frame_s;
            self.is_in_motion &= self.rest_s < quality.settle_s;
        } else if self.is_in_motion && self.rest_s == 0.0 {
            // The time is that of a frame in motion.
            self.control = self.control.after(1e3 * frame_s, quality.target_frame_ms);
        } else {
            (self.is_in_motion, self.rest_s) = (true, 0.0);
            self.control = self.control.in_new_motion();
        }
        self.control = self.control.within(full_voxels, floor_voxels);
        self.is_in_motion &= full_voxels < floor_voxels;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::occlusion::Quality;

    const FULL: f32 = 0.25;
    const FRAME_S: f32 = 0.01;

    /// Steps of frames in which everything moves or nothing does.
    fn steps(quality: &MotionQuality, moves: impl IntoIterator<Item = bool>) -> Vec<Option<f32>> {
        let mut sampling = MotionSampling::default();
        sampling.follow(0, quality, FULL, FRAME_S);
        let mut places = 0;
        let follow = |is_moving: bool| {
            places += u64::from(is_moving);
            sampling.follow(places, quality, FULL, FRAME_S);
            sampling.step_voxels()
        };
        moves.into_iter().map(follow).collect()
    }

    fn moves_then_rests(frames: usize) -> impl Iterator<Item = bool> {
        (0..2 * frames).map(move |frame| frame < frames)
    }

    #[test]
    fn samples_are_full_before_motion_and_after_it_settles() {
        let quality = MotionQuality { target_frame_ms: 1.0, settle_s: 0.035, ..default() };
        let steps = steps(&quality, moves_then_rests(20));
        assert_eq!(steps[0], Some(FULL), "nothing is known of the first frame's time");
        assert_eq!(steps[19], Some(Quality::Low.shading().step_voxels));
        assert_eq!(steps[22], steps[19], "it does not change while it settles");
        assert_eq!(steps[23], None);
        let impatient = MotionQuality { settle_s: f32::NAN, ..quality };
        assert_eq!(self::steps(&impatient, moves_then_rests(20))[20], None);
    }

    #[test]
    fn the_next_motion_begins_as_the_last_one_ended() {
        let quality = MotionQuality { target_frame_ms: 1.0, settle_s: 0.0, ..default() };
        let twice = steps(&quality, moves_then_rests(20).chain([true]));
        assert_eq!(twice.last(), Some(&Some(Quality::Low.shading().step_voxels)));
    }

    #[test]
    fn a_floor_above_the_volumes_own_setting_has_no_effect() {
        for lowest in [Quality::High, Quality::Reference] {
            let quality = MotionQuality { lowest, target_frame_ms: 1.0, ..default() };
            assert!(steps(&quality, [true; 20]).iter().all(Option::is_none), "{lowest}");
        }
    }
}
