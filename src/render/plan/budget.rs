//! How much of the precomputation fits into a frame.

use std::time::{Duration, Instant};

use crate::render::bricks::VOXELS_PER_BRICK;

/// How many samples of step I are taken in one frame: as many as keep the app responsive.
///
/// One dispatch then also stays far below what a driver's watchdog allows (2 s on Windows).
pub(crate) struct PrecomputeBudget {
    samples: u64,
    last_frame: Option<Instant>,
    /// The shortest frame so far: about what a frame takes without computing occlusion.
    shortest: Duration,
}

impl Default for PrecomputeBudget {
    fn default() -> Self {
        Self {
            samples: Self::LEAST,
            last_frame: None,
            shortest: Duration::MAX,
        }
    }
}

impl PrecomputeBudget {
    const LEAST: u64 = 1 << 24;
    const MOST: u64 = 1 << 32;
    /// A frame may take this long for computing occlusion, or twice what it takes anyway.
    const FRAME: Duration = Duration::from_millis(50);
    /// But no longer than this.
    const LONGEST: Duration = Duration::from_secs(1);

    /// Bricks to cast this frame, at least one.
    pub fn bricks(&mut self, samples_per_voxel: u64, now: Instant) -> u32 {
        if let Some(last) = self.last_frame.replace(now) {
            let frame = now.duration_since(last);
            self.shortest = self.shortest.min(frame);
            let allowed = Self::FRAME.max(2 * self.shortest).min(Self::LONGEST);
            let samples = if frame < allowed {
                self.samples * 2
            } else {
                self.samples / 2
            };
            self.samples = samples.clamp(Self::LEAST, Self::MOST);
        }
        let per_brick = (samples_per_voxel * VOXELS_PER_BRICK).max(1);
        (self.samples / per_brick).clamp(1, u32::MAX as u64) as u32
    }

    /// To be called in frames that compute none: the time since then says nothing.
    pub fn pause(&mut self) {
        self.last_frame = None;
        self.shortest = Duration::MAX;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_budget_follows_the_frame_time() {
        let mut budget = PrecomputeBudget::default();
        let mut now = Instant::now();
        let first = budget.bricks(520, now);
        now += Duration::from_millis(10);
        assert!(budget.bricks(520, now) > first, "short frames take more");
        now += Duration::from_secs(3);
        let long = budget.bricks(520, now);
        now += Duration::from_secs(3);
        assert!(budget.bricks(520, now) <= long, "long frames take less");
        assert!(budget.bricks(u64::MAX / 64, now) >= 1, "there is always progress");
    }
}
