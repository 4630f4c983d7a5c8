//! How often values of a volume come with gradients of each length.

use bevy::prelude::*;
use bevy_contextual_ao::prelude::*;

/// Numbers of columns, for values, and of rows, for gradients.
pub const COLUMNS: usize = 96;
pub const ROWS: usize = 40;
/// It counts about this many of a volume's voxels.
const SAMPLES: usize = 1 << 18;
/// Share of the voxels whose gradients lie within its rows.
const SHOWN_SHARE: f64 = 0.999;

/// Frequency of values and gradients, both evenly spaced.
pub struct JointHistogram {
    /// Gradient at the end of the last row, in the volume file's units per mm.
    pub last_per_mm: f32,
    /// Frequency, 0 to 1, logarithmic. A row has values over the volume's range. Rows are those of longer and longer
    /// gradients.
    pub frequencies: Vec<f32>,
}

impl JointHistogram {
    pub fn of(volume: &Volume) -> Self {
        let [low, high] = volume.range();
        let pairs = sample(volume);
        let mut gradients: Vec<f64> = pairs.iter().map(|pair| pair[1]).collect();
        gradients.sort_by(f64::total_cmp);
        let at = (SHOWN_SHARE * gradients.len() as f64) as usize;
        let last = gradients.get(at.min(gradients.len().saturating_sub(1))).copied().unwrap_or_default();
        let last = if last > 0.0 { last } else { 1.0 };
        let mut counts = vec![0u32; COLUMNS * ROWS];
        for [value, gradient] in pairs {
            let column = (value - low) / (high - low).max(f64::MIN_POSITIVE) * COLUMNS as f64;
            let row = gradient / last * ROWS as f64;
            let [column, row] =
                [(column, COLUMNS), (row, ROWS)].map(|(at, count)| (at as usize).min(count - 1));
            counts[row * COLUMNS + column] += 1;
        }
        let logarithms = counts.into_iter().map(|count| (1.0 + count as f32).ln());
        let largest = logarithms.clone().fold(1.0, f32::max);
        Self {
            last_per_mm: last as f32,
            frequencies: logarithms.map(|logarithm| logarithm / largest).collect(),
        }
    }
}

/// Values and lengths of their gradients, of voxels evenly spread.
fn sample(volume: &Volume) -> Vec<[f64; 2]> {
    let size = volume.dimensions();
    let spacing = volume.spacing_mm().to_array().map(f64::from);
    let count = volume.intensities().len();
    let value = |voxel: UVec3| volume.value_at(voxel.min(size - 1)).unwrap_or_default();
    let pair = |index: usize| {
        let index = index as u64;
        let [x, y] = [size.x, size.y].map(u64::from);
        let voxel = UVec3::new((index % x) as u32, (index / x % y) as u32, (index / (x * y)) as u32);
        let slope = |axis: usize| {
            let step = UVec3::AXES[axis];
            (value(voxel + step) - value(voxel.saturating_sub(step))) / (2.0 * spacing[axis])
        };
        let [a, b, c] = [0, 1, 2].map(slope);
        [value(voxel), (a * a + b * b + c * c).sqrt()]
    };
    (0..count).step_by(count / SAMPLES + 1).map(pair).collect()
}
