//! Control of the distance of view samples by the frame time.

/// Factor of a small change, the fourth root of 2.
const SMALL_CHANGE: f32 = 1.189_207_1;
/// Largest factor of a change.
const LARGEST_CHANGE: f32 = 2.0;
/// Share of the target below which a frame is fast. A small change of the distance makes no fast frame slow.
const FAST: f32 = 0.8;
/// Frames after which a change shows in the frame time: rendering may lie two frames behind.
const LATENCY: u32 = 4;
/// Most frames between a change and the next shortening: about a second.
const LONGEST_PATIENCE: u32 = 64;

/// Distance of view samples, as far as a frame time allows.
///
/// A slow frame lengthens the distance in proportion, and fast frames shorten it a little. In between it stays. Where
/// frames wait for a display, times jump, and a shortening that made frames slow would be tried again and again. So
/// each lengthening doubles the patience before the next shortening, for as long as the motion lasts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StepControl {
    /// Distance, voxels.
    pub step_voxels: f32,
    /// Shortest and longest distance, voxels.
    bounds: [f32; 2],
    /// Frames since the last change.
    frames: u32,
    /// Frames to wait before a shortening.
    patience: u32,
}

impl Default for StepControl {
    fn default() -> Self {
        Self { step_voxels: 0.0, bounds: [0.0; 2], frames: 0, patience: LATENCY }
    }
}

impl StepControl {
    /// With these bounds, voxels. The shortest distance holds where it is above the longest.
    pub fn within(self, shortest: f32, longest: f32) -> Self {
        let step_voxels = self.step_voxels.min(longest).max(shortest);
        Self { step_voxels, bounds: [shortest, longest], ..self }
    }

    /// At the beginning of a motion: the times of frames before say nothing.
    pub fn in_new_motion(self) -> Self {
        Self { frames: 0, patience: LATENCY, ..self }
    }

    /// After a frame in motion of this time. A time or target that is no number changes nothing, nor does a time of 0.
    pub fn after(self, frame_ms: f32, target_ms: f32) -> Self {
        let waiting = Self { frames: self.frames.saturating_add(1), ..self };
        if waiting.frames < LATENCY || frame_ms <= 0.0 {
            return waiting;
        }
        let [shortest, longest] = self.bounds;
        if frame_ms > target_ms && self.step_voxels < longest {
            let factor = (frame_ms / target_ms).clamp(SMALL_CHANGE, LARGEST_CHANGE);
            Self {
                step_voxels: (self.step_voxels * factor).min(longest),
                frames: 0,
                patience: (2 * self.patience).min(LONGEST_PATIENCE),
                ..self
            }
        } else if frame_ms < FAST * target_ms
            && self.step_voxels > shortest
            && waiting.frames >= self.patience
        {
            Self { step_voxels: (self.step_voxels / SMALL_CHANGE).max(shortest), frames: 0, ..self }
        } else {
            waiting
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
