//! The components that put a volume into a scene.

use bevy::{
    asset::{AsAssetId, AssetId},
    camera::visibility::{VisibilityClass, add_visibility_class},
    prelude::*,
};

use super::{TransferFunction, Volume, VolumeGeometry};

/// World units per millimetre of a volume: 1 world unit is 1 m. A volume's [`Transform`] applies on top.
pub const WORLD_UNITS_PER_MM: f32 = 0.001;

/// Shows a [`Volume`] on this entity.
///
/// The volume's centre is the entity's origin. The axes are x to the patient's left, y up (superior) and z to the front
/// (anterior). So a patient faces a camera that looks along -z. A millimetre is [`WORLD_UNITS_PER_MM`] in the entity's
/// space. So a [`Transform`] of scale 1 shows the volume at its true size.
///
/// With the plugin the component also requires [`AmbientOcclusion`](crate::occlusion::AmbientOcclusion) and
/// [`VolumeShading`](crate::occlusion::VolumeShading).
///
/// The volume is drawn by a child of the entity; the plugin puts no mesh and no material on the entity itself.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq, Eq, Deref, DerefMut)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(VolumeTransferFunction, OcclusionReady, Transform, Visibility)]
pub struct Volume3d(pub Handle<Volume>);

impl From<Handle<Volume>> for Volume3d {
    fn from(handle: Handle<Volume>) -> Self {
        Self(handle)
    }
}

impl From<Volume3d> for AssetId<Volume> {
    fn from(component: Volume3d) -> Self {
        component.id()
    }
}

impl From<&Volume3d> for AssetId<Volume> {
    fn from(component: &Volume3d) -> Self {
        component.id()
    }
}

impl AsAssetId for Volume3d {
    type Asset = Volume;

    fn as_asset_id(&self) -> AssetId<Volume> {
        self.id()
    }
}

/// The child of a [`Volume3d`] whose box is drawn, as a [`DrawnBox`].
///
/// A clone of the volume has a child of its own: the clone of this one if children are cloned, else a new one.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct VolumeBox(#[entities] pub Entity);

/// The box that the voxels of a grid fill. Views that show it draw the volume.
#[derive(Component, Clone, PartialEq)]
#[require(Visibility, VisibilityClass, BoxMark)]
#[component(on_add = add_visibility_class::<Self>)]
pub(crate) struct DrawnBox(pub VolumeGeometry);

/// Marks the entity of a [`DrawnBox`] in scenes. Whoever writes a volume with its children writes the child with them.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub(crate) struct BoxMark;

/// Removes boxes that were read from scenes: volumes get new ones.
pub(super) fn remove_read_boxes(
    mut commands: Commands,
    boxes: Query<Entity, (With<BoxMark>, Without<DrawnBox>)>,
) {
    for entity in &boxes {
        commands.entity(entity).try_despawn();
    }
}

/// The transfer function of a [`Volume3d`]. The default handle stands for
/// [`TransferFunction::for_volume`], made when the volume has loaded.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq, Eq, Deref, DerefMut)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct VolumeTransferFunction(pub Handle<TransferFunction>);

impl From<Handle<TransferFunction>> for VolumeTransferFunction {
    fn from(handle: Handle<TransferFunction>) -> Self {
        Self(handle)
    }
}

impl From<VolumeTransferFunction> for AssetId<TransferFunction> {
    fn from(component: VolumeTransferFunction) -> Self {
        component.id()
    }
}

impl From<&VolumeTransferFunction> for AssetId<TransferFunction> {
    fn from(component: &VolumeTransferFunction) -> Self {
        component.id()
    }
}

impl AsAssetId for VolumeTransferFunction {
    type Asset = TransferFunction;

    fn as_asset_id(&self) -> AssetId<TransferFunction> {
        self.id()
    }
}

/// Whether everything that the shading of a [`Volume3d`] needs is ready.
///
/// It is `false` while the volume, the shaders or the meshes of its carvers are on their way to the GPU.
///
/// Occlusion is computed in the frame that shows it. A change of the transfer function, of
/// [`AmbientOcclusion`](crate::occlusion::AmbientOcclusion) or of a carver's pose makes the value `false` for a frame
/// at most. A carver with a new mesh makes it `false` until the mesh's layers are counted.
// Not a component of scenes: it is derived.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct OcclusionReady(pub bool);
