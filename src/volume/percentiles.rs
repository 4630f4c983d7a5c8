//! Percentiles of a volume's values.

use super::{Volume, otsu};

/// Sorted values of a volume, split by Otsu's threshold: dark values around a body, bright values in it.
pub(super) struct Percentiles {
    sorted: Vec<f64>,
    /// Number of dark values.
    dark: usize,
}

impl Percentiles {
    /// Largest number of sampled values; more would not move a percentile by much.
    const SAMPLES: usize = 1 << 19;

    /// Bins of the histogram for the peak: wide enough that no bin falls between 8-bit values.
    const BINS: usize = 64;

    /// Sorts and splits the values of a volume.
    pub fn of(volume: &Volume) -> Self {
        let voxels = volume.intensities();
        // The stride is odd: with a power of two of voxels per row, an even stride would sample few columns.
        let stride = (voxels.len() / Self::SAMPLES) | 1;
        let stored = (0..voxels.len()).step_by(stride).filter_map(|index| voxels.get(index));
        let mut sorted: Vec<f64> = stored.map(|stored| volume.to_file_units(stored.into())).collect();
        sorted.sort_by(f64::total_cmp);
        let threshold = volume.to_file_units(otsu::threshold(volume));
        let dark = sorted.partition_point(|&value| value < threshold);
        Self { sorted, dark }
    }

    /// The value, in file units, that this share of the dark values does not exceed.
    pub fn dark(&self, share: f64) -> f64 {
        Self::percentile(&self.sorted[..self.dark], share).unwrap_or_else(|| self.bright(0.0))
    }

    /// The value, in file units, that this share of the bright values does not exceed.
    pub fn bright(&self, share: f64) -> f64 {
        Self::percentile(&self.sorted[self.dark..], share).unwrap_or_default()
    }

    /// End of the peak of bright values: the first value above the most common value that is less than a
    /// tenth as common.
    pub fn end_of_peak(&self) -> f64 {
        let bright = &self.sorted[self.dark..];
        let [low, high] = [0.0, 1.0].map(|share| self.bright(share));
        let width = (high - low) / Self::BINS as f64;
        let below = |bin: usize| bright.partition_point(|&value| value < low + bin as f64 * width);
        let counts: Vec<usize> = (0..Self::BINS).map(|bin| below(bin + 1) - below(bin)).collect();
        let (peak, &most) = counts.iter().enumerate().max_by_key(|&(_, count)| count).unwrap_or((0, &0));
        let end = (peak..Self::BINS).find(|&bin| 10 * counts[bin] < most).unwrap_or(Self::BINS);
        low + end as f64 * width
    }

    /// The value that this share of the sorted values does not exceed.
    fn percentile(sorted: &[f64], share: f64) -> Option<f64> {
        let last = sorted.len().checked_sub(1)?;
        sorted.get((share * last as f64).round() as usize).copied()
    }
}
