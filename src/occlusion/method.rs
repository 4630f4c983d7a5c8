//! By which method ambient occlusion is computed, and the settings of each.

use bevy::prelude::*;

use super::{DirectOcclusion, OcclusionFiltering, OcclusionSweeping, ProgressiveRays, ScreenSpaceOcclusion};

/// The systems of the papers. All see what carvers leave of a volume; `docs/methods.md` says what each is good for
/// and where it fails.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub enum OcclusionMethod {
    /// Rays around every voxel: local ambient occlusion, of which only what changed is recomputed. Exact.
    #[default]
    Rays,
    /// The same rays, a few in every frame: lags behind.
    Progressive(ProgressiveRays),
    /// Fast occlusion sweeping: light seeps through the whole volume, along the diagonals of the grid.
    Sweeping(OcclusionSweeping),
    /// Volumetric ambient occlusion by filtering: how many voxels around one are denser.
    Filtering(OcclusionFiltering),
    /// Screen-space ambient occlusion of the first surface that a view sees.
    ScreenSpace(ScreenSpaceOcclusion),
    /// Direct occlusion shading: light from a cone around the viewer.
    Direct(DirectOcclusion),
}

impl OcclusionMethod {
    /// All methods with their default settings, in the order of a menu.
    pub fn all() -> [Self; 6] {
        [
            Self::Rays,
            Self::Progressive(default()),
            Self::Sweeping(default()),
            Self::Filtering(default()),
            Self::ScreenSpace(default()),
            Self::Direct(default()),
        ]
    }

    /// The name used on command lines and in tables.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Rays => "rays",
            Self::Progressive(_) => "progressive",
            Self::Sweeping(_) => "sweeping",
            Self::Filtering(_) => "filtering",
            Self::ScreenSpace(_) => "screen_space",
            Self::Direct(_) => "direct",
        }
    }

    /// These settings within what can be computed, and equal to themselves.
    pub(crate) fn clamped(self) -> Self {
        match self {
            Self::Progressive(settings) => Self::Progressive(settings.clamped()),
            Self::Filtering(settings) => Self::Filtering(settings.clamped()),
            Self::Sweeping(settings) => Self::Sweeping(settings.clamped()),
            Self::ScreenSpace(settings) => Self::ScreenSpace(settings.clamped()),
            Self::Direct(settings) => Self::Direct(settings.clamped()),
            Self::Rays => Self::Rays,
        }
    }

    /// Whether rays are cast around voxels.
    pub(crate) fn casts_rays(&self) -> bool {
        matches!(self, Self::Rays | Self::Progressive(_))
    }

    /// Whether a factor is kept for every voxel, whoever looks at it. Otherwise views compute their own.
    pub fn is_of_voxels(&self) -> bool {
        !matches!(self, Self::ScreenSpace(_) | Self::Direct(_))
    }
}

impl core::str::FromStr for OcclusionMethod {
    type Err = String;

    /// A method with its default settings.
    fn from_str(name: &str) -> Result<Self, String> {
        Self::all().into_iter().find(|method| method.name() == name).ok_or_else(|| {
            let names = Self::all().map(|method| method.name()).join(", ");
            format!("unknown occlusion method `{name}`: expected one of {names}")
        })
    }
}
