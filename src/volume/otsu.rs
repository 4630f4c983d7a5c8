//! Otsu's method, on a volume's histogram.

use super::asset::{Intensities, Volume};

/// The stored value that best splits a volume's histogram in two by Otsu's method; it lies between two bins.
pub(super) fn threshold(volume: &Volume) -> f64 {
    const BINS: usize = 256;
    /// Largest number of sampled voxels; more would not move the threshold.
    const SAMPLES: usize = 1 << 22;
    let [low, high] = volume.stored_range();
    let width = usize::from(high - low) + 1;
    let mut histogram = [0.0f64; BINS];
    // The stride is odd: with a power of two of voxels per row, an even stride would sample few columns.
    let stride = (volume.intensities().len() / SAMPLES) | 1;
    let mut count = |stored: u16| {
        let bin = usize::from(stored.saturating_sub(low)) * BINS / width.max(BINS);
        if let Some(bin) = histogram.get_mut(bin) {
            *bin += 1.0;
        }
    };
    match volume.intensities() {
        Intensities::U8(values) => values.iter().step_by(stride).for_each(|&v| count(v.into())),
        Intensities::U16(values) => values.iter().step_by(stride).for_each(|&v| count(v)),
    }
    let total: f64 = histogram.iter().sum();
    let moment = |bins: &[f64]| bins.iter().enumerate().map(|(i, n)| i as f64 * n).sum::<f64>();
    let total_moment = moment(&histogram);
    let (mut below, mut below_moment) = (0.0, 0.0);
    // The first and the last of equally good bins, which span a gap in the histogram.
    let (mut best, mut best_variance) = ([0.0; 2], -1.0);
    for (index, bin) in histogram.iter().enumerate() {
        below += bin;
        below_moment += index as f64 * bin;
        let above = total - below;
        if below == 0.0 || above <= 0.0 {
            continue;
        }
        let distance = below_moment / below - (total_moment - below_moment) / above;
        let variance = below * above * distance * distance;
        if variance > best_variance {
            (best, best_variance) = ([index as f64 + 1.0; 2], variance);
        } else if variance == best_variance {
            best[1] = index as f64 + 1.0;
        }
    }
    let bin_width = width.max(BINS) as f64 / BINS as f64;
    let best = (best[0] + best[1]) / 2.0;
    // Between the last value below and the first above.
    (f64::from(low) + best * bin_width - 0.5).clamp(low.into(), high.into())
}
