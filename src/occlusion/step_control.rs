//! Control of the distance of view samples by the frame time.

use super::frame_control::{FrameControl, Room};

/// Largest factor of a change.
const LARGEST_CHANGE: f32 = 2.0;

/// Distance of view samples, as far as a frame time allows: saved samples lie farther apart ([`FrameControl`]).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct StepControl {
    /// Distance, voxels.
    pub step_voxels: f32,
    /// Shortest and longest distance, voxels.
    bounds: [f32; 2],
    control: FrameControl,
}

impl StepControl {
    /// With these bounds, voxels. The shortest distance holds where it is above the longest.
    pub fn within(self, shortest: f32, longest: f32) -> Self {
        let step_voxels = self.step_voxels.min(longest).max(shortest);
        Self { step_voxels, bounds: [shortest, longest], ..self }
    }

    /// At the beginning of a motion: the times of frames before say nothing.
    pub fn in_new_motion(self) -> Self {
        Self { control: FrameControl::default(), ..self }
    }

    /// After a frame in motion of this time.
    pub fn after(mut self, frame_ms: f32, target_ms: f32) -> Self {
        let [shortest, longest] = self.bounds;
        let room = Room {
            saves: self.step_voxels < longest,
            spends: self.step_voxels > shortest,
            largest_saving: LARGEST_CHANGE,
        };
        let saving = self.control.saving_after(frame_ms, target_ms, room);
        if saving != 1.0 {
            self.step_voxels = (self.step_voxels * saving).min(longest).max(shortest);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::frame_control::{FAST, LONGEST_PATIENCE},
        *,
    };

    const BOUNDS: [f32; 2] = [0.25, 2.0];
    const TARGET_MS: f32 = 10.0;

    /// Steps of frames whose time depends on the step, and is known two frames later.
    fn run(start: f32, frames: usize, frame_ms: impl Fn(f32) -> f32) -> Vec<f32> {
        let mut control = StepControl { step_voxels: start, ..StepControl::default() };
        control = control.within(BOUNDS[0], BOUNDS[1]);
        let mut steps = vec![control.step_voxels; 3];
        for frame in 0..frames {
            control = control.after(frame_ms(steps[frame]), TARGET_MS).within(BOUNDS[0], BOUNDS[1]);
            steps.push(control.step_voxels);
        }
        let is_bounded = |step: &f32| (BOUNDS[0]..=BOUNDS[1]).contains(step);
        assert!(steps.iter().all(is_bounded), "{steps:?}");
        steps
    }

    fn changes(steps: &[f32]) -> usize {
        steps.windows(2).filter(|pair| pair[0] != pair[1]).count()
    }

    #[test]
    fn frames_come_to_the_target_and_the_step_stays() {
        // Some of the time is not that of samples.
        for (fixed_ms, sample_ms) in [(0.0, 6.0), (4.0, 4.0), (8.0, 1.0), (0.0, 18.0)] {
            let frame_ms = |step: f32| fixed_ms + sample_ms / step;
            for start in [BOUNDS[0], 0.7, BOUNDS[1]] {
                let steps = run(start, 400, frame_ms);
                let [.., last] = steps[..] else { unreachable!("there are steps") };
                let context = format!("{fixed_ms} {sample_ms} from {start}: {last}");
                assert!(frame_ms(last) <= TARGET_MS, "{context}");
                assert!(frame_ms(last) >= FAST * TARGET_MS || last == BOUNDS[0], "{context}");
                assert_eq!(changes(&steps[300..]), 0, "{context}");
                assert!(changes(&steps) <= 14, "{context}: {} changes", changes(&steps));
            }
        }
    }

    #[test]
    fn what_cannot_be_reached_ends_at_a_bound() {
        assert_eq!(run(0.5, 100, |_| 1e6).last(), Some(&BOUNDS[1]));
        assert_eq!(run(0.5, 100, |_| f32::INFINITY).last(), Some(&BOUNDS[1]));
        assert_eq!(run(1.0, 400, |_| 1e-3).last(), Some(&BOUNDS[0]));
    }

    #[test]
    fn what_is_no_time_changes_nothing() {
        for frame_ms in [f32::NAN, 0.0, -1.0] {
            assert_eq!(changes(&run(0.5, 100, |_| frame_ms)), 0, "{frame_ms}");
        }
        let control = StepControl { step_voxels: 0.6, ..StepControl::default() }.within(BOUNDS[0], BOUNDS[1]);
        let after =
            |target_ms| (0..100).fold(control, |control, _| control.after(5.0, target_ms)).step_voxels;
        assert_eq!(after(f32::NAN), 0.6);
        assert_eq!([after(0.0), after(-1.0), after(f32::NEG_INFINITY)], [BOUNDS[1]; 3]);
        assert_eq!(after(f32::INFINITY), BOUNDS[0]);
    }

    #[test]
    fn a_display_that_frames_wait_for_sees_few_changes() {
        // Intervals of 7.5 ms: a frame takes one or two.
        let frame_ms = |step: f32| 7.5 * (5.0 / step / 7.5).ceil();
        let steps = run(BOUNDS[0], 1000, frame_ms);
        let late = &steps[500..];
        assert!(changes(late) <= 500 * 2 / LONGEST_PATIENCE as usize + 2, "{} changes", changes(late));
        assert!(late.iter().all(|step| (0.5..1.0).contains(step)), "{late:?}");
    }
}
