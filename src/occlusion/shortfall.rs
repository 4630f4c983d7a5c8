//! Fallbacks for occlusion that does not fit the device or the budget.

use bevy::prelude::*;

/// Event on a volume whose [`AmbientOcclusion`](super::AmbientOcclusion) cannot be computed as set. It is triggered
/// again when its shortfall changes.
#[derive(EntityEvent, Clone, Copy, Debug, PartialEq)]
pub struct OcclusionFailed {
    /// The volume's entity.
    pub entity: Entity,
    /// The memory that is missing, and the fallback.
    pub shortfall: OcclusionShortfall,
}

/// Memory that an occlusion method does not get.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("its occlusion needs {needed} {limit} {max}: {fallback}")]
pub struct OcclusionShortfall {
    /// Amount that the method needs: bytes or texels, as `limit` says.
    pub needed: u64,
    /// Kind of limit that is exceeded.
    pub limit: OcclusionLimit,
    /// Largest amount that the limit allows.
    pub max: u64,
    /// Occlusion used instead.
    pub fallback: OcclusionFallback,
}

/// A limit on the memory of an occlusion method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum OcclusionLimit {
    /// Bytes of the largest buffer that the device binds.
    #[error("bytes in one buffer, and this graphics device binds at most")]
    Buffer,
    /// Texels along an axis of a 3D texture.
    #[error("texels along one axis, and this graphics device holds at most")]
    Texture,
    /// Bytes of [`VolumeBudget`](crate::volume::VolumeBudget) that others leave.
    #[error("bytes in all, and others leave of VolumeBudget")]
    Budget,
}

/// Replacement for a method that does not fit.
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

/// Logs a shortfall.
pub(super) fn warn_of_shortfall(failed: On<OcclusionFailed>) {
    warn!("the volume on {}: {}", failed.entity, failed.shortfall);
}
