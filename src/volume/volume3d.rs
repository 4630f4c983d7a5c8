//! The components that put a volume into a scene.

use bevy::prelude::*;

use super::{TransferFunction, Volume};

/// World units per millimetre of a volume: 1 world unit is 1 m. A volume's [`Transform`] comes on top.
pub const WORLD_UNITS_PER_MM: f32 = 0.001;

/// Shows a [`Volume`] on this entity.
///
/// The volume's centre is the entity's origin: x to the patient's left, y up (superior), z to the front
/// (anterior), so that a patient faces a camera that looks along -z. A millimetre is [`WORLD_UNITS_PER_MM`]
/// in the entity's space, so a [`Transform`] of scale 1 shows the volume at its size.
///
/// With the plugin it requires [`AmbientOcclusion`](crate::occlusion::AmbientOcclusion) and
/// [`VolumeShading`](crate::occlusion::VolumeShading) as well.
///
/// The volume is drawn by a child of the entity; the plugin puts no mesh and no material on the entity itself.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq, Eq, Deref, DerefMut)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(VolumeTransferFunction, OcclusionProgress, Transform, Visibility)]
pub struct Volume3d(pub Handle<Volume>);

/// The child of a [`Volume3d`] whose box the volume is drawn on.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct VolumeBox(pub Entity);

/// The transfer function of a [`Volume3d`]. The default handle stands for
/// [`TransferFunction::for_volume`], made when the volume has loaded.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq, Eq, Deref, DerefMut)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct VolumeTransferFunction(pub Handle<TransferFunction>);

/// Whether all that the shading of a [`Volume3d`] needs is there: 1, or 0 while the volume, the shaders or
/// the meshes of its carvers are on their way to the device.
///
/// What is computed is computed in the frame that shows it: changes of the transfer function, of
/// [`AmbientOcclusion`](crate::occlusion::AmbientOcclusion) or of a carver's pose do not lower it for longer than a frame. A carver with a new
/// mesh does, for the frames until it is known how many layers the mesh has.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct OcclusionProgress(pub f32);
