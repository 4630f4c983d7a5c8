//! The bundle that puts a volume into a scene.

use bevy::prelude::*;

use crate::{
    occlusion::{AmbientOcclusion, Quality, VolumeShading},
    volume::{TransferFunction, Volume, Volume3d, VolumeTransferFunction},
};

/// Components of a volume, with defaults for all but its file.
///
/// The camera needs a near plane of about a thousandth of the volume's size:
/// `PerspectiveProjection { near: 0.001, ..default() }` for a head. Bevy's default of 0.1 world units is 0.1 m
/// here. A camera that comes closer than that slices the volume open.
#[derive(Bundle, Clone, Debug)]
pub struct VolumeBundle {
    /// The volume.
    pub volume: Volume3d,
    /// Its transfer function.
    pub transfer_function: VolumeTransferFunction,
    /// Its occlusion method and settings.
    pub occlusion: AmbientOcclusion,
    /// Its shading settings.
    pub shading: VolumeShading,
    /// Its place in the world.
    pub transform: Transform,
}

impl VolumeBundle {
    /// Makes a volume with default settings at the world's origin, at 1 world unit per metre.
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

    /// Sets the rays, their resolution and the view samples to a preset.
    pub fn with_quality(mut self, quality: Quality) -> Self {
        quality.apply(&mut self.shading, &mut self.occlusion);
        self
    }
}
