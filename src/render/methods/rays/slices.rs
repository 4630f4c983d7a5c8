//! Slices of a ray cast: one dispatch each.

/// Most slices of a cast. Larger volumes have larger slices.
pub(super) const MOST_SLICES: u32 = 256;
/// Bytes in front of the slices in `CastState` in WGSL, and bytes of a slice.
const STATE_HEAD: u64 = 20;
const SLICE_BYTES: u64 = 12;

/// Slices of a ray cast.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Slices {
    pub count: u32,
    /// Most words of a slice.
    pub words: u32,
}

impl Slices {
    /// Slices of a list with so many words at most.
    pub fn of(words: u32, most_words: u32) -> Self {
        let words_per_slice = most_words.max(words.div_ceil(MOST_SLICES)).max(1);
        Self { count: words.div_ceil(words_per_slice).max(1), words: words_per_slice }
    }

    /// Bytes of `CastState` in WGSL.
    pub fn state_bytes(self) -> u64 {
        arguments_of(self.count)
    }
}

/// First byte of the arguments of a slice's dispatch, in `CastState` in WGSL.
pub(super) fn arguments_of(slice: u32) -> u64 {
    STATE_HEAD + SLICE_BYTES * u64::from(slice)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_hold_all_words_and_no_more_than_they_may() {
        assert_eq!(Slices::of(65_536, 65_536), Slices { count: 1, words: 65_536 });
        assert_eq!(Slices::of(65_537, 65_536), Slices { count: 2, words: 65_536 });
        assert_eq!(Slices::of(4 << 20, 65_536), Slices { count: 64, words: 65_536 });
        // No more slices than there are numbers for.
        assert_eq!(Slices::of(1 << 20, 1), Slices { count: 256, words: 4096 });
        assert_eq!(Slices::of(3, 0), Slices { count: 3, words: 1 });
    }
}
