//! The resource that lets the frame time bound the rays of a frame.

use bevy::prelude::*;

use super::frame_control::{FrameControl, LATENCY, Room, SMALL_CHANGE};

/// Bounds the words of a frame by the frame time, for each volume ([`CastBudget`](super::CastBudget) says what a word
/// is). Insert it for steady frames. Without it every frame casts all that it needs.
///
/// A frame that would take longer than its slot shows the occlusion that is known so far. The other words wait, the
/// oldest first. Until their turn voxels keep the factor that they had, and new ones are drawn as if unoccluded.
/// [`OcclusionReady`](crate::volume::OcclusionReady) says when none waits: the picture is then the exact one, bit for bit.
///
/// The bound comes from frames: a slow one that cast rays lowers it in proportion, fast ones that were bounded raise it a
/// little. Nothing is bounded before the first slow frame. Slow frames that cast nothing change nothing.
/// [`CastBudget::words_per_frame`](super::CastBudget::words_per_frame) is never written; the smaller of both holds.
/// Removing the resource casts at once all that waits.
#[derive(Resource, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Resource, Default, Debug, Clone, PartialEq)]
pub struct CastPacing {
    /// Longest frame time, milliseconds, by [`Time<Real>`]. A higher one casts more rays a frame and is complete sooner,
    /// a lower one keeps frames shorter. Where frames wait for a display, as in a headset, it needs to be 4/3 of the
    /// display's interval: waiting hides how much faster a frame could be.
    pub target_frame_ms: f32,
    /// Words that a frame may always cast. More of them bring occlusion up to date sooner where frames are slow for
    /// other reasons, and fewer keep such frames shorter. At 0 it is one word.
    pub least_words_per_frame: u32,
}

impl Default for CastPacing {
    fn default() -> Self {
        // 90 frames a second, and a third more.
        Self { target_frame_ms: 14.8, least_words_per_frame: 256 }
    }
}

/// Frames that are looked at: the number of a frame's words arrives some frames later, and so does its time.
const RECENT: usize = 2 * LATENCY as usize + 1;

/// Most words of a frame for one volume, as its frames' times ask for.
#[derive(Debug, Default)]
pub(crate) struct PacedWords {
    /// `None` before a slow frame cast any.
    most: Option<f32>,
    control: FrameControl,
    /// The last frames, latest first: the time known in a frame, milliseconds, and words that it cast, once known.
    recent: [(f32, u32); RECENT],
}

impl PacedWords {
    /// Most words of this frame; `None` for all.
    pub fn most(&self) -> Option<u32> {
        self.most.map(|most| most as u32)
    }

    /// Begins a frame, in which the time of the frame before is known.
    pub fn begin_frame(&mut self, frame_ms: f32) {
        self.recent.rotate_right(1);
        self.recent[0] = (frame_ms, 0);
    }

    /// Takes note of the words that a frame cast, so many frames ago.
    pub fn note(&mut self, frames_ago: u64, words: u32) {
        if let Some(recent) = usize::try_from(frames_ago).ok().and_then(|ago| self.recent.get_mut(ago)) {
            recent.1 = words;
        }
    }

    /// Follows the frame time.
    pub fn follow(&mut self, pacing: &CastPacing) {
        let least = pacing.least_words_per_frame.max(1) as f32;
        let largest = |of: &[(f32, u32)]| of.iter().map(|(_, words)| *words).max().unwrap_or(0);
        let most = match self.most {
            Some(most) => {
                let cast = largest(&self.recent);
                if cast == 0 {
                    self.control.forget_patience();
                }
                let is_reached = cast >= most as u32;
                let room = Room {
                    saves: cast > 0 && most > least,
                    spends: is_reached,
                    largest_saving: f32::INFINITY,
                };
                most / self.control.saving_after(self.recent[0].0, pacing.target_frame_ms, room)
            }
            None => {
                // All words that may have made that frame slow are known by now.
                let (frame_ms, _) = self.recent[LATENCY as usize];
                let cast = largest(&self.recent[LATENCY as usize + 1..]);
                let is_slow = frame_ms > pacing.target_frame_ms;
                if cast == 0 || !is_slow {
                    return;
                }
                cast as f32 * (pacing.target_frame_ms / frame_ms).min(SMALL_CHANGE.recip())
            }
        };
        self.most = Some(most.max(least));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PACING: CastPacing = CastPacing { target_frame_ms: 10.0, least_words_per_frame: 20 };
    /// Frames after which the words of a cast are known.
    const READ_BACK: u64 = 2;

    /// Casts of a volume whose frames take a fixed time and a time for every word.
    struct Casts {
        paced: PacedWords,
        drawing_ms: f32,
        ms_per_word: f32,
        waiting: u32,
        cast: Vec<u32>,
    }

    impl Casts {
        fn new(drawing_ms: f32, ms_per_word: f32) -> Self {
            Self { paced: PacedWords::default(), drawing_ms, ms_per_word, waiting: 0, cast: vec![0] }
        }

        fn frame_ms(&self) -> f32 {
            self.drawing_ms + self.ms_per_word * *self.cast.last().expect("a frame") as f32
        }

        /// A frame that needs so many words more. Returns how many it casts.
        fn frame(&mut self, needs: u32) -> u32 {
            self.paced.begin_frame(self.frame_ms());
            let frame = self.cast.len();
            if let Some(ago) = frame.checked_sub(READ_BACK as usize) {
                self.paced.note(READ_BACK, self.cast[ago]);
            }
            self.paced.follow(&PACING);
            self.waiting += needs;
            let cast = self.waiting.min(self.paced.most().unwrap_or(u32::MAX));
            self.waiting -= cast;
            self.cast.push(cast);
            cast
        }
    }

    #[test]
    fn the_next_jump_keeps_to_the_target() {
        let mut casts = Casts::new(2.0, 0.01);
        (0..20).for_each(|_| assert_eq!(casts.frame(100), 100, "nothing is slow"));
        assert_eq!(casts.frame(20_000), 20_000, "nothing was slow before");
        (0..20).for_each(|_| assert_eq!(casts.frame(100), 100, "it is below the bound"));
        casts.waiting = 20_000;
        let mut slow = 0;
        for frame in 0..60 {
            casts.frame(100);
            slow += usize::from(casts.frame_ms() > PACING.target_frame_ms);
            assert!(
                casts.frame_ms() < 1.3 * PACING.target_frame_ms,
                "{} ms in frame {frame}",
                casts.frame_ms()
            );
        }
        assert!(slow < 8, "{slow} slow frames");
        assert_eq!(casts.waiting, 0);
    }

    #[test]
    fn slow_frames_keep_the_floor_and_fast_ones_raise_it() {
        let mut casts = Casts::new(100.0, 0.0);
        (0..40).for_each(|_| _ = casts.frame(200));
        assert_eq!(casts.frame(200), PACING.least_words_per_frame);
        casts.drawing_ms = 1.0;
        let mut frames = 0;
        while casts.waiting > 0 {
            casts.frame(0);
            frames += 1;
            assert!(frames < 400, "{} words wait", casts.waiting);
        }
        assert!(casts.cast.iter().rev().take(20).max() > Some(&PACING.least_words_per_frame));
    }

    #[test]
    fn slow_drawing_alone_lowers_nothing() {
        let mut casts = Casts::new(100.0, 0.0);
        (0..40).for_each(|_| _ = casts.frame(0));
        assert_eq!(casts.paced.most(), None);
        // A bound that there is stays.
        casts.frame(1000);
        (0..40).for_each(|_| _ = casts.frame(0));
        let most = casts.paced.most();
        assert!(most.is_some());
        (0..40).for_each(|_| _ = casts.frame(0));
        assert_eq!(casts.paced.most(), most);
    }

    #[test]
    fn what_is_no_time_changes_nothing() {
        for frame_ms in [f32::NAN, 0.0, -1.0] {
            let mut casts = Casts::new(frame_ms, 0.0);
            (0..40).for_each(|_| assert_eq!(casts.frame(1000), 1000, "{frame_ms}"));
        }
        for (target_frame_ms, most) in
            [(f32::NAN, None), (f32::INFINITY, None), (0.0, Some(1)), (-1.0, Some(1))]
        {
            let mut paced = PacedWords::default();
            for _ in 0..2 * RECENT {
                paced.begin_frame(5.0);
                paced.note(1, 1000);
                paced.follow(&CastPacing { target_frame_ms, least_words_per_frame: 0 });
            }
            assert_eq!(paced.most(), most, "{target_frame_ms}");
        }
    }
}
