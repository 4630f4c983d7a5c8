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
        Self { samples: Self::LEAST, last_frame: None, shortest: Duration::MAX }
    }
}

impl PrecomputeBudget {
    const LEAST: u64 = 1 << 24;
    const MOST: u64 = 1 << 32;
    /// A frame may take this long for computing occlusion, or twice what it takes anyway.
    const FRAME: Duration = Duration::from_millis(50);
    /// But no longer than this.
    const LONGEST: Duration = Duration::from_secs(1);

    /// What this frame may compute, to be shared by all volumes.
    pub fn share(&mut self, now: Instant) -> BudgetShare {
        if let Some(last) = self.last_frame.replace(now) {
            let frame = now.duration_since(last);
            self.shortest = self.shortest.min(frame);
            let allowed = Self::FRAME.max(2 * self.shortest).min(Self::LONGEST);
            let is_short = frame < allowed;
            let samples = if is_short { self.samples * 2 } else { self.samples / 2 };
            self.samples = samples.clamp(Self::LEAST, Self::MOST);
        }
        BudgetShare(self.samples)
    }

    /// To be called in frames that compute none: the time since then says nothing.
    pub fn pause(&mut self) {
        self.last_frame = None;
        self.shortest = Duration::MAX;
    }
}

/// Samples that are left for this frame.
pub(crate) struct BudgetShare(u64);

impl BudgetShare {
    /// Bricks that a volume may cast, of those that it `wants`: at least one.
    pub fn take(&mut self, samples_per_voxel: u64, wants: u32) -> u32 {
        let per_brick = samples_per_voxel.saturating_mul(VOXELS_PER_BRICK).max(1);
        let bricks = (self.0 / per_brick).clamp(1, wants.max(1) as u64);
        self.0 = self.0.saturating_sub(bricks.saturating_mul(per_brick));
        bricks as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_budget_follows_the_frame_time() {
        let mut budget = PrecomputeBudget::default();
        let mut now = Instant::now();
        let mut frame = |ms| {
            now += Duration::from_millis(ms);
            budget.share(now).take(520, u32::MAX)
        };
        let first = frame(0);
        let second = frame(10);
        assert!(second > first, "a short frame is followed by more");
        let third = frame(3000);
        assert!(third < second, "a long one by less");
    }

    #[test]
    fn volumes_share_the_budget_and_all_advance() {
        let mut share = PrecomputeBudget::default().share(Instant::now());
        let first = share.take(520, u32::MAX);
        assert!(first > 1);
        assert_eq!(share.take(520, u32::MAX), 1);
        assert_eq!(share.take(u64::MAX, 5), 1);
    }
}
