//! The first transfer function of a volume.

use super::volume::{DicomUnit, DicomVolume};
use crate::volume::{Preset, TransferFunction, Volume};

/// Grey of bones on film, and of everything else within a window.
const GREY: [f32; 3] = [0.92, 0.89, 0.84];
/// Hot spots of PET.
const HOT: [f32; 3] = [1.0, 0.55, 0.15];
/// Uptake of healthy tissue and of a clear finding, SUV.
const UPTAKE: [f32; 2] = [1.5, 8.0];

impl DicomVolume {
    /// A first transfer function for the volume that was read.
    ///
    /// The file's first window, if it has one: transparent at its lower end, opaque at its upper end. Otherwise the
    /// modality decides: [`Preset::CtSoftTissue`] for Hounsfield units, a ramp over 1.5 to 8 for SUV,
    /// [`Preset::MrHead`], which goes by percentiles, for MR, and a guess by the histogram for all others.
    pub fn first_look(&self, volume: &Volume) -> TransferFunction {
        let windows = self.windows();
        let window = windows.first().and_then(|window| {
            let [from, to] = [-0.5, 0.5].map(|half| (window.center + half * window.width) as f32);
            TransferFunction::ramp(from, to, 0.9, GREY).ok()
        });
        window.unwrap_or_else(|| self.by_modality(volume))
    }

    /// The modality's transfer function, whatever windows the file has.
    pub fn by_modality(&self, volume: &Volume) -> TransferFunction {
        match (self.unit(), self.modality()) {
            (DicomUnit::Hounsfield, _) => Preset::CtSoftTissue.transfer_function(volume),
            (DicomUnit::Suv, _) => TransferFunction::ramp(UPTAKE[0], UPTAKE[1], 0.9, HOT)
                .unwrap_or_else(|_| TransferFunction::for_volume(volume)),
            (_, "MR") => Preset::MrHead.transfer_function(volume),
            _ => TransferFunction::for_volume(volume),
        }
    }
}
