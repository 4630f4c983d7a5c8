//! The transfer function of one volume as a table for the GPU.

use bevy::{
    color::{ColorToComponents, Srgba},
    prelude::*,
};
use std::sync::Arc;

use super::{TransferFunction, Volume, VolumeGeometry};

/// The transfer function of a [`Volume3d`](super::Volume3d) over the volume's range of intensities,
/// inserted and kept up to date by the plugin.
#[derive(Component, Clone, Debug, PartialEq)]
pub struct LookupTable {
    /// Linear RGB and the opacity per unit distance, 0 to 1. A row has [`LookupTable::ENTRIES`] entries, evenly spaced
    /// over [`LookupTable::stored_range`]. There is one row, or [`LookupTable::GRADIENTS`] for different gradients.
    pub entries: Arc<Vec<[f32; 4]>>,
    /// Gradient of the last row, in stored intensities per millimetre. Rows are evenly spaced from 0 on. Beyond the last
    /// the function is constant. `None` if the gradient has no effect: there is one row.
    pub last_gradient: Option<f64>,
    /// Stored intensities of the first and the last entry. Beyond them the function is constant.
    pub stored_range: [f64; 2],
    /// Length, mm, over which the entries' opacity accumulates.
    pub opacity_unit_distance_mm: f32,
    /// The volume.
    pub volume: Volume,
    /// The volume's grid.
    pub geometry: VolumeGeometry,
    /// The transfer function that the table was baked from.
    pub(super) function: AssetId<TransferFunction>,
    /// Number of changes of the table.
    pub revision: u32,
    /// Number of changes of the volume's data.
    pub volume_revision: u32,
}

impl LookupTable {
    /// Number of entries: one for every intensity of a 12-bit CT.
    pub const ENTRIES: usize = 4096;
    /// Number of rows for different gradients.
    pub const GRADIENTS: usize = 32;

    pub(crate) fn bake(function: &TransferFunction, volume: &Volume) -> Self {
        let [lo, hi] = volume.stored_range().map(f64::from);
        // Entries cover only the range in which the function varies: a narrow window of a 16-bit volume gets
        // all of them. One more intensity at either end gives a step there both its sides.
        let points = || function.all_points().map(|point| volume.to_stored(point.value.into()));
        let first = points().reduce(f64::min).unwrap_or(0.0);
        let last = points().reduce(f64::max).unwrap_or(0.0);
        let start = (first.floor() - 1.0).clamp(lo, hi);
        let end = (last.ceil() + 1.0).clamp(lo, hi);
        // With enough entries, every stored intensity has its own entry.
        let (span, last) = (end - start, (Self::ENTRIES - 1) as f64);
        let step = if span <= last { (last / span.max(1.0)).floor().recip() } else { span / last };
        let entry = |k: usize, gradient: Option<f32>| {
            let value = volume.to_file_units(start + k as f64 * step) as f32;
            let sample = gradient.map(|gradient| function.sample_at(value, gradient));
            let [r, g, b, opacity] = sample.unwrap_or_else(|| function.sample(value));
            // Control points hold display colours; light adds up linearly.
            let [r, g, b] = LinearRgba::from(Srgba::rgb(r, g, b)).to_f32_array_no_alpha();
            [r, g, b, opacity]
        };
        let last_gradient = function.last_gradient();
        let gradients: Vec<_> = match last_gradient {
            None => vec![None],
            Some(last) => {
                let row = |row: usize| Some(last * row as f32 / (Self::GRADIENTS - 1) as f32);
                (0..Self::GRADIENTS).map(row).collect()
            }
        };
        let row = |gradient| (0..Self::ENTRIES).map(move |k| entry(k, gradient));
        let unit_mm = f64::from(function.gradient_unit.mm(volume.spacing_mm()));
        let stored_per_mm = (volume.to_stored(1.0) - volume.to_stored(0.0)).abs() / unit_mm;
        Self {
            entries: Arc::new(gradients.into_iter().flat_map(row).collect()),
            last_gradient: last_gradient.map(|last| f64::from(last) * stored_per_mm),
            stored_range: [start, start + last * step],
            opacity_unit_distance_mm: function.opacity_unit_distance_mm,
            geometry: VolumeGeometry::of(volume),
            volume: volume.clone(),
            function: AssetId::default(),
            revision: 0,
            volume_revision: 0,
        }
    }

    /// Number of rows.
    pub(crate) fn rows(&self) -> u32 {
        if self.last_gradient.is_some() { Self::GRADIENTS as u32 } else { 1 }
    }

    /// Largest opacity of each entry, whatever the gradient.
    pub(crate) fn largest_opacities(&self) -> impl DoubleEndedIterator<Item = f32> + ExactSizeIterator {
        (0..Self::ENTRIES).map(|k| {
            let of_rows = self.entries.iter().skip(k).step_by(Self::ENTRIES).map(|entry| entry[3]);
            of_rows.fold(0.0, f32::max)
        })
    }
}
