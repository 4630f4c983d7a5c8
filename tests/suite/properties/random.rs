//! Random choices, the same in every run.

/// A linear congruential generator; its upper bits are good enough here.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// From zero to below `end`.
    pub(crate) fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end
    }

    pub(crate) fn pick<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }

    pub(crate) fn flip(&mut self) -> bool {
        self.below(2) == 0
    }

    pub(crate) fn bytes(&mut self, count: usize) -> Vec<u8> {
        (0..count).map(|_| self.below(256) as u8).collect()
    }

    /// From 0 to 1, in few digits.
    pub(crate) fn share(&mut self) -> f32 {
        self.below(101) as f32 / 100.0
    }
}
