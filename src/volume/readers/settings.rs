//! What a caller may choose about reading a file.

use serde::{Deserialize, Serialize};

use crate::volume::error::VolumeError;

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
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct VolumeReadSettings {
    /// Which volume to read, counted from zero in the file's order, of a file that holds several on one grid: a
    /// time series, phases, a list. `None` where there is only one; a file with more is then refused, and the
    /// error says how many there are.
    pub component: Option<u32>,
}

impl VolumeReadSettings {
    /// The component to read of `count`, which differ in what `along` says.
    pub(super) fn choose(&self, count: u64, along: &str) -> Result<u64, VolumeError> {
        match self.component.map(u64::from) {
            Some(chosen) if chosen < count => Ok(chosen),
            None if count == 1 => Ok(0),
            _ => Err(VolumeError::Component { count, along: along.to_owned(), chosen: self.component }),
        }
    }
}
