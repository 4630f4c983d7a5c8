//! What a caller may choose about reading a file.

use bevy::math::{DAffine3, DVec3};
use serde::{Deserialize, Serialize};

use super::header::GridHeader;
use crate::volume::{asset::Volume, error::VolumeError};

/// How a volume's file is read; also the asset loader's settings:
///
/// ```no_run
/// # use bevy::prelude::*;
/// # use bevy_contextual_ao::volume::{Volume, VolumeReadSettings};
/// # fn system(assets: Res<AssetServer>) {
/// let third_phase: Handle<Volume> = assets
///     .load_builder()
///     .with_settings(|settings: &mut VolumeReadSettings| settings.component = Some(2))
///     .load("heart.nrrd");
/// # }
/// ```
///
/// Bevy loads a path once: as long as one component of a file is loaded, its path means that one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct VolumeReadSettings {
    /// Which volume to read, counted from zero in the file's order, of a file that holds several on one grid: a
    /// time series, phases, a list. `None` where there is only one; a file with more is then refused, and the
    /// error says how many there are.
    pub component: Option<u32>,
    /// All lengths are multiplied by this: 0.001 where a file says metres and means millimetres. A number that is no
    /// scale is an error.
    pub length_scale: f64,
    /// How often the resolution is halved along each axis, once the file is read: each time an eighth of the voxels.
    /// At most 8.
    pub halvings: u32,
}

impl Default for VolumeReadSettings {
    fn default() -> Self {
        Self { component: None, length_scale: 1.0, halvings: 0 }
    }
}

impl VolumeReadSettings {
    /// The same header, in its lengths.
    pub(super) fn scale(&self, header: GridHeader) -> Result<GridHeader, VolumeError> {
        if !(self.length_scale > 0.0 && self.length_scale.is_finite()) {
            let scale = self.length_scale.to_string();
            return Err(VolumeError::field("length_scale", &scale, "must be finite and positive"));
        }
        let scale = DAffine3::from_scale(DVec3::splat(self.length_scale));
        GridHeader { grid_to_patient: scale * header.grid_to_patient, ..header }.checked()
    }

    /// The volume at the resolution that is asked for.
    pub(crate) fn halve(&self, volume: Volume) -> Volume {
        (0..self.halvings.min(8)).fold(volume, |volume, _| volume.halved())
    }

    /// The component to read of `count`, which differ in what `along` says.
    pub(super) fn choose(&self, count: u64, along: &str) -> Result<u64, VolumeError> {
        match self.component.map(u64::from) {
            Some(chosen) if chosen < count => Ok(chosen),
            None if count == 1 => Ok(0),
            _ => Err(VolumeError::Component { count, along: along.to_owned(), chosen: self.component }),
        }
    }
}
