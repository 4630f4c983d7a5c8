//! Changes from frame to frame.

/// Frame-to-frame changes of the bytes of voxels or pixels. `None` is a value that nobody can see. Appearing and
/// disappearing do not count.
#[derive(Default)]
pub struct Changes {
    last: Vec<Option<u8>>,
    largest: u8,
    /// Sum of squares per byte.
    squares: Vec<u64>,
    frames: u64,
}

impl Changes {
    /// Adds the bytes of the next frame.
    pub fn add(&mut self, frame: Vec<Option<u8>>) {
        self.squares.resize(frame.len(), 0);
        if !self.last.is_empty() {
            self.frames += 1;
            for ((now, before), squares) in frame.iter().zip(&self.last).zip(&mut self.squares) {
                let (Some(now), Some(before)) = (now, before) else { continue };
                let change = now.abs_diff(*before);
                self.largest = self.largest.max(change);
                *squares += u64::from(change) * u64::from(change);
            }
        }
        self.last = frame;
    }

    /// The largest change between two frames, as a share of the full range.
    pub fn largest(&self) -> f64 {
        f64::from(self.largest) / 255.0
    }

    /// The root of the mean squared change, over the bytes that change here or in `other`.
    pub fn rms(&self, other: &Self) -> f64 {
        let moves = |changes: &Self, k: usize| changes.squares.get(k).is_some_and(|squares| *squares > 0);
        let count = (0..self.squares.len()).filter(|&k| moves(self, k) || moves(other, k)).count();
        let sum: u64 = self.squares.iter().sum();
        (sum as f64 / (self.frames as f64 * count as f64).max(1.0)).sqrt() / 255.0
    }
}
