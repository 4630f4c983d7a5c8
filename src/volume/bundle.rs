//! The components that put a volume into a scene, and the events about it.

use bevy::{
    asset::{AssetLoadError, AssetLoadFailedEvent, AssetPath, LoadState},
    prelude::*,
};

use super::{TransferFunction, Volume};
use crate::occlusion::{AmbientOcclusion, VolumeShading};

/// World units per millimetre of a volume's default scale: 1 world unit is 1 m.
pub const WORLD_UNITS_PER_MM: f32 = 0.001;

/// Shows a [`Volume`] on this entity.
///
/// The entity's local space is in millimetres around the volume's centre: x to the patient's left,
/// y up (superior), z to the front (anterior), so that a patient faces a camera that looks along
/// -z. The default [`Transform`] therefore scales by [`WORLD_UNITS_PER_MM`]; who sets another
/// transform keeps that scale, or starts from [`VolumeBundle::with_transform`].
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq, Eq, Deref, DerefMut)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(
    VolumeTransferFunction,
    AmbientOcclusion,
    VolumeShading,
    OcclusionProgress,
    Transform = Transform::from_scale(Vec3::splat(WORLD_UNITS_PER_MM)),
    Visibility,
)]
pub struct Volume3d(pub Handle<Volume>);

/// The transfer function of a [`Volume3d`]. The default handle stands for
/// [`TransferFunction::for_volume`], made when the volume has loaded.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq, Eq, Deref, DerefMut)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct VolumeTransferFunction(pub Handle<TransferFunction>);

/// Whether all that the shading of a [`Volume3d`] needs is there: 1, or 0 while the volume, the shaders or
/// the meshes of its carvers are on their way to the device.
///
/// What is computed is computed in the frame that shows it: changes of the transfer function, of
/// [`AmbientOcclusion`] or of a carver's pose do not lower it for longer than a frame. A carver with a new
/// mesh does, for the frames until it is known how many layers the mesh has.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct OcclusionProgress(pub f32);

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
    /// Volume space (mm) to world.
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
            transform: Transform::from_scale(Vec3::splat(WORLD_UNITS_PER_MM)),
        }
    }

    /// Sets the transfer function.
    pub fn with_transfer_function(mut self, transfer_function: Handle<TransferFunction>) -> Self {
        self.transfer_function = VolumeTransferFunction(transfer_function);
        self
    }

    /// Places the volume. The scale comes on top of [`WORLD_UNITS_PER_MM`].
    pub fn with_transform(mut self, transform: Transform) -> Self {
        self.transform = transform.with_scale(transform.scale * WORLD_UNITS_PER_MM);
        self
    }
}

/// Triggered on a [`Volume3d`] entity when its volume and its transfer function have been read, and
/// again when the volume is replaced.
#[derive(EntityEvent, Clone, Debug)]
pub struct VolumeLoaded {
    /// The volume's entity.
    pub entity: Entity,
}

/// Triggered on a [`Volume3d`] entity when its volume or transfer function cannot be shown.
#[derive(EntityEvent, Clone, Debug)]
pub struct VolumeFailed {
    /// The volume's entity.
    pub entity: Entity,
    /// What went wrong: names the file and the cause.
    pub error: String,
}

/// Triggered on a [`Volume3d`] entity when its [`OcclusionProgress`] becomes 1.
#[derive(EntityEvent, Clone, Debug)]
pub struct VolumeOccluded {
    /// The volume's entity.
    pub entity: Entity,
}

/// Tells the entities of a volume why it cannot be shown.
pub(super) fn report_failures(
    mut commands: Commands,
    mut failed: MessageReader<AssetLoadFailedEvent<Volume>>,
    mut failed_functions: MessageReader<AssetLoadFailedEvent<TransferFunction>>,
    asset_server: Res<AssetServer>,
    entities: Query<(Entity, Ref<Volume3d>, Ref<VolumeTransferFunction>)>,
) {
    let failed: Vec<_> = failed.read().collect();
    let failed_functions: Vec<_> = failed_functions.read().collect();
    for (entity, volume, function) in &entities {
        let of_volume = failed.iter().filter(|event| event.id == volume.id());
        let of_function = failed_functions.iter().filter(|event| event.id == function.id());
        // A file that failed before the entity came.
        let earlier = [
            volume.is_changed().then(|| asset_server.get_load_state(&volume.0)).flatten(),
            function.is_changed().then(|| asset_server.get_load_state(&function.0)).flatten(),
        ];
        let errors = of_volume
            .map(|event| describe(&event.path, &event.error))
            .chain(of_function.map(|event| describe(&event.path, &event.error)))
            .chain(earlier.iter().flatten().filter_map(|state| match state {
                LoadState::Failed(error) => Some(first_line(error)),
                _ => None,
            }));
        for error in errors {
            commands.trigger(VolumeFailed { entity, error });
        }
    }
}

fn describe(path: &AssetPath, error: &AssetLoadError) -> String {
    format!("{path}: {}", first_line(error))
}

/// Without the backtrace that Bevy may append.
fn first_line(error: &impl ToString) -> String {
    error.to_string().lines().next().unwrap_or_default().to_owned()
}
