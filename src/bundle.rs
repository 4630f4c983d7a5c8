//! All that puts a volume into a scene, in one bundle.

use bevy::prelude::*;

use crate::{
    occlusion::{AmbientOcclusion, VolumeShading},
    volume::{TransferFunction, Volume, Volume3d, VolumeTransferFunction},
};

/// Everything a volume needs, with defaults for all but the file.
///
/// The camera needs a near plane of about a thousandth of the volume's size:
/// `PerspectiveProjection { near: 0.001, ..default() }` for a head. Bevy's default of 0.1 world units is 0.1 m
/// here, and a camera that comes closer than that slices the volume open.
#[derive(Bundle, Clone, Debug)]
pub struct VolumeBundle {
    /// The volume.
    pub volume: Volume3d,
    /// Its transfer function.
    pub transfer_function: VolumeTransferFunction,
    /// How its occlusion is computed.
    pub occlusion: AmbientOcclusion,
    /// How it is drawn.
    pub shading: VolumeShading,
    /// Where it is in the world.
    pub transform: Transform,
}

impl VolumeBundle {
    /// A volume with default settings, in the world's origin, at 1 world unit per metre.
    pub fn new(volume: Handle<Volume>) -> Self {
        Self {
            volume: Volume3d(volume),
            transfer_function: default(),
            occlusion: default(),
            shading: default(),
            transform: default(),
        }
    }

    /// Sets the transfer function.
    pub fn with_transfer_function(mut self, transfer_function: Handle<TransferFunction>) -> Self {
        self.transfer_function = VolumeTransferFunction(transfer_function);
        self
    }

    /// Places the volume.
    pub fn with_transform(mut self, transform: Transform) -> Self {
        self.transform = transform;
        self
    }
}
