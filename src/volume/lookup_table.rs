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
    /// [`LookupTable::ENTRIES`] values, evenly spaced over [`LookupTable::stored_range`]: linear
    /// RGB and the opacity per unit distance, 0 to 1.
    pub entries: Arc<Vec<[f32; 4]>>,
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

    pub(crate) fn bake(function: &TransferFunction, volume: &Volume) -> Self {
        let [lo, hi] = volume.stored_range().map(f64::from);
        // Entries cover only the range in which the function varies: a narrow window of a 16-bit volume gets
        // all of them. One more intensity at either end gives a step there both its sides.
        let ends = [function.points.first(), function.points.last()]
            .map(|point| point.map_or(0.0, |point| volume.to_stored(point.value as f64)));
        let start = (ends[0].min(ends[1]).floor() - 1.0).clamp(lo, hi);
        let end = (ends[0].max(ends[1]).ceil() + 1.0).clamp(lo, hi);
        // With enough entries, every stored intensity has its own entry.
        let (span, last) = (end - start, (Self::ENTRIES - 1) as f64);
        let step = if span <= last { (last / span.max(1.0)).floor().recip() } else { span / last };
        let entries = (0..Self::ENTRIES)
            .map(|k| {
                let value = volume.to_file_units(start + k as f64 * step);
                let [r, g, b, opacity] = function.sample(value as f32);
                // Control points hold display colours; light adds up linearly.
                let [r, g, b] = LinearRgba::from(Srgba::rgb(r, g, b)).to_f32_array_no_alpha();
                [r, g, b, opacity]
            })
            .collect();
        Self {
            entries: Arc::new(entries),
            stored_range: [start, start + last * step],
            opacity_unit_distance_mm: function.opacity_unit_distance_mm,
            geometry: VolumeGeometry::of(volume),
            volume: volume.clone(),
            function: AssetId::default(),
            revision: 0,
            volume_revision: 0,
        }
    }
}
