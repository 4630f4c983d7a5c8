//! Random choices, the same in every run.

use bevy::math::{Quat, Vec3};

/// A linear congruential generator; its upper bits are good enough here.
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize
    }

    /// An integer from zero to below `end`.
    pub fn below(&mut self, end: usize) -> usize {
        self.next() % end
    }

    pub fn pick<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }

    pub fn flip(&mut self) -> bool {
        self.below(2) == 0
    }

    pub fn bytes(&mut self, count: usize) -> Vec<u8> {
        (0..count).map(|_| self.below(256) as u8).collect()
    }

    /// A number from 0 to 1, in hundredths.
    pub fn share(&mut self) -> f32 {
        self.below(101) as f32 / 100.0
    }

    /// A number from -1 to 1.
    pub fn signed(&mut self) -> f32 {
        self.next() as f32 / (1u32 << 30) as f32 - 1.0
    }

    /// A point of the cube from -1 to 1.
    pub fn point(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }

    /// A rotation by up to `angle` radians about any axis.
    pub fn rotation(&mut self, angle: f32) -> Quat {
        let axis = self.point().try_normalize().unwrap_or(Vec3::Y);
        Quat::from_axis_angle(axis, angle * self.signed())
    }
}
