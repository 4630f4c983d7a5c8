//! Events of volumes: loaded, failed, occluded.

use bevy::{
    asset::{AssetLoadError, AssetLoadFailedEvent, LoadState},
    prelude::*,
};
use std::sync::Arc;

use super::{TransferFunction, Volume, Volume3d, VolumeFileError, VolumeTransferFunction, budget::TooLarge};

/// Triggered on a [`Volume3d`] entity when its volume and its transfer function have been read, and
/// again when the volume is replaced.
#[derive(EntityEvent, Clone, Debug)]
pub struct VolumeLoaded {
    /// The volume's entity.
    pub entity: Entity,
}

/// Triggered on a [`Volume3d`] entity when its volume or transfer function cannot be shown. A volume that the
/// entity showed before stays.
#[derive(EntityEvent, Clone, Debug)]
pub struct VolumeFailed {
    /// The volume's entity.
    pub entity: Entity,
    /// Cause of the failure.
    pub reason: VolumeFailure,
}

/// Reason why a volume cannot be shown. Its text names the file, if any, and the cause.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VolumeFailure {
    /// The volume's file cannot be read.
    #[error("{}", describe(.0))]
    Volume(Arc<AssetLoadError>),
    /// The transfer function's file cannot be read.
    #[error("{}", describe(.0))]
    TransferFunction(Arc<AssetLoadError>),
    /// The volume is too large for the device or the budget.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
}

/// Triggered on a [`Volume3d`] entity when its [`OcclusionReady`](super::OcclusionReady) becomes `true`.
#[derive(EntityEvent, Clone, Debug)]
pub struct VolumeOccluded {
    /// The volume's entity.
    pub entity: Entity,
}

/// The file and the cause, each once, without the backtrace that Bevy may append.
fn describe(error: &AssetLoadError) -> String {
    let text = match error {
        AssetLoadError::AssetLoaderError(error) => match error.error().downcast_ref::<VolumeFileError>() {
            // The fault names its own file, which may be a data file beside the header.
            Some(fault) if fault.path == error.path().path() => fault.to_string(),
            Some(fault) => format!("{}: {fault}", error.path()),
            None => format!("{}: {}", error.path(), error.error()),
        },
        error => error.to_string(),
    };
    text.lines().next().unwrap_or_default().to_owned()
}

/// Triggers [`VolumeFailed`] on entities whose volume or transfer function cannot be read. Bevy has logged it.
pub(super) fn report_unreadable(
    mut commands: Commands,
    mut failed: MessageReader<AssetLoadFailedEvent<Volume>>,
    mut failed_functions: MessageReader<AssetLoadFailedEvent<TransferFunction>>,
    asset_server: Res<AssetServer>,
    entities: Query<(Entity, Ref<Volume3d>, Ref<VolumeTransferFunction>)>,
) {
    let failed: Vec<_> = failed.read().collect();
    let failed_functions: Vec<_> = failed_functions.read().collect();
    for (entity, volume, function) in &entities {
        let earlier = volume.is_changed().then(|| asset_server.get_load_state(&volume.0)).flatten();
        if let Some(error) = failure(volume.id(), &failed, earlier) {
            commands.trigger(VolumeFailed { entity, reason: VolumeFailure::Volume(error) });
        }
        let earlier = function.is_changed().then(|| asset_server.get_load_state(&function.0)).flatten();
        if let Some(error) = failure(function.id(), &failed_functions, earlier) {
            commands.trigger(VolumeFailed { entity, reason: VolumeFailure::TransferFunction(error) });
        }
    }
}

/// The error of a file that failed now, or earlier by its load state.
fn failure<A: Asset>(
    id: AssetId<A>,
    now: &[&AssetLoadFailedEvent<A>],
    earlier: Option<LoadState>,
) -> Option<Arc<AssetLoadError>> {
    let now = now.iter().find(|event| event.id == id).map(|event| Arc::new(event.error.clone()));
    now.or(match earlier {
        Some(LoadState::Failed(error)) => Some(error),
        _ => None,
    })
}

/// Logs failures that Bevy has not logged.
pub(super) fn log_failures(failed: On<VolumeFailed>) {
    if let VolumeFailure::TooLarge(reason) = &failed.reason {
        error!("the volume on {} is not shown: {reason}", failed.entity);
    }
}
