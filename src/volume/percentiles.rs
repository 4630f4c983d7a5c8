//! Percentiles of a volume's values.

use super::{Volume, otsu};

/// Values of a volume, sorted and parted by Otsu's threshold: what is around a body, and the body.
pub(super) struct Percentiles {
    sorted: Vec<f64>,
    /// How many are dark.
    dark: usize,
}

impl Percentiles {
    /// Values that are looked at, at most; more would not move a percentile by much.
    const SAMPLES: usize = 1 << 19;

    /// Of the histogram in which a peak is sought: wide enough that no bin falls between the values of eight bits.
    const BINS: usize = 64;

    /// Of a volume.
    pub fn of(volume: &Volume) -> Self {
        let voxels = volume.intensities();
        // Odd, so that a power of two of voxels per row does not put all samples in a few columns.
        let stride = (voxels.len() / Self::SAMPLES) | 1;
        let stored = (0..voxels.len()).step_by(stride).filter_map(|index| voxels.get(index));
        let mut sorted: Vec<f64> = stored.map(|stored| volume.to_file_units(stored.into())).collect();
        sorted.sort_by(f64::total_cmp);
        let threshold = volume.to_file_units(otsu::threshold(volume));
        let dark = sorted.partition_point(|&value| value < threshold);
        Self { sorted, dark }
    }

    /// The value, in the file's units, that this share of the dark ones do not exceed.
    pub fn dark(&self, share: f64) -> f64 {
        Self::percentile(&self.sorted[..self.dark], share).unwrap_or_else(|| self.bright(0.0))
    }

    /// The same of the bright ones.
    pub fn bright(&self, share: f64) -> f64 {
        Self::percentile(&self.sorted[self.dark..], share).unwrap_or_default()
    }

    /// Where the peak of the bright values ends: above their most common one, from where on they are less than a
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

    /// The value that this share of sorted ones do not exceed.
    fn percentile(sorted: &[f64], share: f64) -> Option<f64> {
        let last = sorted.len().checked_sub(1)?;
        sorted.get((share * last as f64).round() as usize).copied()
    }
}
