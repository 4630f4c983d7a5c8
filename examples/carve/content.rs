//! Facts about a volume for the panel.

use bevy::math::Vec3;
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::digits::significant;

use super::joint_histogram::JointHistogram;

/// Number of bars of the histogram behind the transfer function.
const HISTOGRAM_BARS: usize = 512;
/// A histogram of a large volume counts about this many of its voxels.
const HISTOGRAM_SAMPLES: usize = 1 << 20;

/// Facts about a volume that has been read.
pub struct Content {
    /// Dimensions and spacing of the voxels, in one line.
    pub summary: String,
    /// Distances between voxels, mm.
    pub spacing_mm: Vec3,
    /// Smallest and largest value.
    pub range: [f32; 2],
    /// Frequency of values, evenly spaced over the range: 0 to 1, logarithmic.
    pub histogram: Vec<f32>,
    /// Frequency of values and their gradients.
    pub gradients: JointHistogram,
}

impl Content {
    pub fn of(volume: &Volume) -> Self {
        let size = volume.dimensions();
        let [x, y, z] = volume.spacing_mm().to_array().map(significant);
        Self {
            summary: format!("{} x {} x {} voxels of {x} x {y} x {z} mm", size.x, size.y, size.z),
            spacing_mm: volume.spacing_mm(),
            range: volume.range().map(|value| value as f32),
            histogram: histogram(volume),
            gradients: JointHistogram::of(volume),
        }
    }

    /// Gradient at the end of the histogram's last row, in a function's unit.
    pub fn last_gradient(&self, function: &TransferFunction) -> f32 {
        self.gradients.last_per_mm * function.gradient_unit.mm(self.spacing_mm)
    }
}

fn histogram(volume: &Volume) -> Vec<f32> {
    let [low, high] = volume.range();
    let width = (high - low).max(f64::MIN_POSITIVE);
    let mut counts = vec![0u32; HISTOGRAM_BARS];
    let voxels = volume.intensities();
    for index in (0..voxels.len()).step_by(voxels.len() / HISTOGRAM_SAMPLES + 1) {
        let Some(stored) = voxels.get(index) else {
            break;
        };
        let t = (volume.to_file_units(stored.into()) - low) / width;
        let bar = (t * HISTOGRAM_BARS as f64) as usize;
        counts[bar.min(HISTOGRAM_BARS - 1)] += 1;
    }
    let logarithms = counts.into_iter().map(|count| (1.0 + count as f32).ln());
    let largest = logarithms.clone().fold(1.0, f32::max);
    logarithms.map(|logarithm| logarithm / largest).collect()
}
