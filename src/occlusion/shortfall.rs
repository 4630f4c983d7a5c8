//! What becomes of occlusion that does not fit the device or the budget.

use bevy::prelude::*;

/// Triggered on a volume whose [`AmbientOcclusion`](super::AmbientOcclusion) cannot be computed as it is set, and again
/// when the settings or the memory that is missing change.
#[derive(EntityEvent, Clone, Copy, Debug, PartialEq)]
pub struct OcclusionFailed {
    /// The volume's entity.
    pub entity: Entity,
    /// What is missing, and what is done instead.
    pub shortfall: OcclusionShortfall,
}

/// Memory that an occlusion method does not get.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("its occlusion needs {needed} {limit} {max}: {fallback}")]
pub struct OcclusionShortfall {
    /// What it needs: bytes or texels, as `limit` says.
    pub needed: u64,
    /// What limits it.
    pub limit: OcclusionLimit,
    /// What it can have.
    pub max: u64,
    /// What is done instead.
    pub fallback: OcclusionFallback,
}

/// What limits the memory of an occlusion method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum OcclusionLimit {
    /// Bytes of the largest buffer that the device binds.
    #[error("bytes in one buffer, and this graphics device binds at most")]
    Buffer,
    /// Texels along an axis of a 3D texture.
    #[error("texels along one axis, and this graphics device holds at most")]
    Texture,
    /// Bytes that others leave of [`VolumeBudget`](crate::volume::VolumeBudget).
    #[error("bytes in all, and others leave of VolumeBudget")]
    Budget,
}

/// What is done in place of a method that does not fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum OcclusionFallback {
    /// The volume is drawn without occlusion.
    #[error("the volume is drawn without occlusion")]
    Unoccluded,
    /// Progressive rays are cast all at once.
    #[error("all rays are cast at once")]
    AllRaysAtOnce,
    /// Sweeping keeps the octants' mean, without the geometry term.
    #[error("the octants' mean is kept, without the geometry term")]
    NoGeometryTerm,
}

/// Logs it.
pub(super) fn warn_of_shortfall(failed: On<OcclusionFailed>) {
    warn!("the volume on {}: {}", failed.entity, failed.shortfall);
}
