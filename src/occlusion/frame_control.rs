//! Control of the work of a frame by the frame time.

/// Factor of a small change, the fourth root of 2.
pub(super) const SMALL_CHANGE: f32 = 1.189_207_1;
/// Share of the target below which a frame is fast. A small change makes no fast frame slow.
pub(super) const FAST: f32 = 0.8;
/// Frames after which a change shows in the frame time: rendering may lie two frames behind.
pub(super) const LATENCY: u32 = 4;
/// Most frames between a change and the next one to more work: about a second.
pub(super) const LONGEST_PATIENCE: u32 = 64;

/// Says by which factor frames are to do less or more work.
///
/// A slow frame asks for less in proportion, and fast frames ask for a little more. In between nothing changes. Where
/// frames wait for a display, times jump, and more work that made frames slow would be tried again and again. So each
/// saving doubles the patience before the next try.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FrameControl {
    /// Frames since the last change.
    frames: u32,
    /// Frames to wait before more work.
    patience: u32,
}

/// Changes that are possible.
#[derive(Clone, Copy)]
pub(super) struct Room {
    /// Whether a frame can do less work.
    pub saves: bool,
    /// Whether a frame can do more work.
    pub spends: bool,
    /// Largest factor of one saving.
    pub largest_saving: f32,
}

impl Default for FrameControl {
    fn default() -> Self {
        Self { frames: 0, patience: LATENCY }
    }
}

impl FrameControl {
    /// Where the times of earlier frames say nothing of the next ones, but for how long ago the last change was.
    pub fn forget_patience(&mut self) {
        self.patience = LATENCY;
    }

    /// After a frame of this time: above 1 the factor of a saving, below 1 that of more work, 1 for no change. A time or
    /// target that is no number changes nothing, nor does a time of 0.
    pub fn saving_after(&mut self, frame_ms: f32, target_ms: f32, room: Room) -> f32 {
        let waited = self.frames.saturating_add(1);
        let can_tell = waited >= LATENCY && frame_ms > 0.0;
        self.frames = 0;
        if can_tell && frame_ms > target_ms && room.saves {
            self.patience = (2 * self.patience).min(LONGEST_PATIENCE);
            (frame_ms / target_ms).clamp(SMALL_CHANGE, room.largest_saving)
        } else if can_tell && frame_ms < FAST * target_ms && room.spends && waited >= self.patience {
            SMALL_CHANGE.recip()
        } else {
            self.frames = waited;
            1.0
        }
    }
}
