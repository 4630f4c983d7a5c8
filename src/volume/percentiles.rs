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

    /// The value that this share of sorted ones do not exceed.
    fn percentile(sorted: &[f64], share: f64) -> Option<f64> {
        let last = sorted.len().checked_sub(1)?;
        sorted.get((share * last as f64).round() as usize).copied()
    }
}
