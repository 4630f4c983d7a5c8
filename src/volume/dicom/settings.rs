//! Settings for reading.

use serde::{Deserialize, Serialize};

/// Slices whose distances differ by more than a hundredth: one is missing, or the scanner changed its step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum UnevenSlices {
    /// Slices are interpolated at even distances, with a warning.
    #[default]
    Resample,
    /// The volume is refused.
    Refuse,
}

/// Settings for reading DICOM files; also the asset loader's settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct DicomReadSettings {
    /// Index of the series that is loaded as an asset, from zero for the series with the most slices.
    pub series: u32,
    /// Index of the volume that is loaded as an asset: of the phases, echoes or b-values of the series.
    pub volume: u32,
    /// Treatment of slices at uneven distances.
    pub uneven: UnevenSlices,
    /// Bytes that the volume may take on the graphics device: [`VolumeBudget::max_bytes`], which an app that changes
    /// it must repeat here.
    ///
    /// They are counted before the pixels are decoded. A larger volume is refused; uneven slices are resampled to a
    /// coarser step. A higher value reads larger volumes, and takes more memory while reading.
    ///
    /// [`VolumeBudget::max_bytes`]: crate::volume::VolumeBudget::max_bytes
    pub max_bytes: u64,
    /// Number of times that the resolution is halved along each axis after reading, at most 8. Each halving leaves
    /// an eighth of the voxels.
    pub halvings: u32,
}

impl Default for DicomReadSettings {
    fn default() -> Self {
        Self { series: 0, volume: 0, uneven: UnevenSlices::default(), max_bytes: 4 << 30, halvings: 0 }
    }
}
