//! Settings for reading a file.

use bevy::math::{DAffine3, DVec3};
use serde::{Deserialize, Serialize};

use super::header::GridHeader;
use crate::volume::{asset::Volume, error::VolumeError};

/// Settings for reading a volume's file; also the asset loader's settings:
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
/// Bevy loads a path once: while one component of a file is loaded, its path means this component.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct VolumeReadSettings {
    /// Index of the volume to read, from zero in the file's order.
    ///
    /// It is for a file that holds several volumes on one grid: a time series, phases, a list. With `None`, a file with
    /// several volumes is refused, and the error says how many there are.
    pub component: Option<u32>,
    /// Factor on all lengths: 0.001 if a file says metres and means millimetres. It must be finite and positive.
    pub length_scale: f64,
    /// Number of times that the resolution is halved along each axis after reading, at most 8. Each halving leaves
    /// an eighth of the voxels.
    pub halvings: u32,
}

impl Default for VolumeReadSettings {
    fn default() -> Self {
        Self { component: None, length_scale: 1.0, halvings: 0 }
    }
}

impl VolumeReadSettings {
    /// Multiplies the header's lengths by [`length_scale`](Self::length_scale).
    pub(super) fn scale(&self, header: GridHeader) -> Result<GridHeader, VolumeError> {
        if !(self.length_scale > 0.0 && self.length_scale.is_finite()) {
            let scale = self.length_scale.to_string();
            return Err(VolumeError::field("length_scale", &scale, "must be finite and positive"));
        }
        let scale = DAffine3::from_scale(DVec3::splat(self.length_scale));
        GridHeader { grid_to_patient: scale * header.grid_to_patient, ..header }.checked()
    }

    /// Halves the volume's resolution [`halvings`](Self::halvings) times.
    pub(crate) fn halve(&self, volume: Volume) -> Volume {
        (0..self.halvings.min(8)).fold(volume, |volume, _| volume.halved())
    }

    /// Index of the component to read, of `count` components. For errors, `along` names their difference.
    pub(super) fn choose(&self, count: u64, along: &str) -> Result<u64, VolumeError> {
        match self.component.map(u64::from) {
            Some(chosen) if chosen < count => Ok(chosen),
            None if count == 1 => Ok(0),
            _ => Err(VolumeError::Component { count, along: along.to_owned(), chosen: self.component }),
        }
    }
}
