//! The methods of computing ambient occlusion, with their settings.

use bevy::prelude::*;
use core::any::Any;

use super::{CustomMethod, MethodKind, MethodSettings, OcclusionFallback, OcclusionRays, ProgressiveRays};
#[cfg(feature = "other_methods")]
use super::{
    DirectionalOcclusion, OcclusionFiltering, OcclusionSweeping, ScreenSpaceOcclusion, SummedAreaOcclusion,
};

/// A method of computing ambient occlusion. All methods see the carved volume; `docs/methods.md` says what each is good
/// for and where it fails.
#[derive(Reflect, Clone, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum OcclusionMethod {
    /// Rays around every voxel: local ambient occlusion, recomputed only where it changed. Exact.
    Rays(OcclusionRays),
    /// The same rays, a few in every frame: the image lags behind changes.
    Progressive(ProgressiveRays),
    /// Fast occlusion sweeping: light seeps through the whole volume, along the diagonals of the grid.
    #[cfg(feature = "other_methods")]
    Sweeping(OcclusionSweeping),
    /// Volumetric ambient occlusion by filtering: the share of denser voxels around each voxel.
    #[cfg(feature = "other_methods")]
    Filtering(OcclusionFiltering),
    /// Summed-area tables: the mean opacity of a box around each voxel, or of its shells.
    #[cfg(feature = "other_methods")]
    SummedArea(SummedAreaOcclusion),
    /// Screen-space ambient occlusion of the first surface that a view sees.
    #[cfg(feature = "other_methods")]
    ScreenSpace(ScreenSpaceOcclusion),
    /// Directional occlusion shading: light from a cone around the viewer.
    #[cfg(feature = "other_methods")]
    Directional(DirectionalOcclusion),
    /// A method that another plugin brings ([`OcclusionMethod::custom`]).
    Custom(CustomMethod),
}

impl Default for OcclusionMethod {
    fn default() -> Self {
        Self::Rays(default())
    }
}

/// Lets settings of a method stand for the method.
macro_rules! from_settings {
    ($($(#[$feature:meta])? $variant:ident($settings:ty);)*) => {
        $($(#[$feature])? impl From<$settings> for OcclusionMethod {
            fn from(settings: $settings) -> Self {
                Self::$variant(settings)
            }
        })*
    };
}

from_settings! {
    Rays(OcclusionRays);
    Progressive(ProgressiveRays);
    #[cfg(feature = "other_methods")]
    Sweeping(OcclusionSweeping);
    #[cfg(feature = "other_methods")]
    Filtering(OcclusionFiltering);
    #[cfg(feature = "other_methods")]
    SummedArea(SummedAreaOcclusion);
    #[cfg(feature = "other_methods")]
    ScreenSpace(ScreenSpaceOcclusion);
    #[cfg(feature = "other_methods")]
    Directional(DirectionalOcclusion);
    Custom(CustomMethod);
}

impl OcclusionMethod {
    const COUNT: usize = if cfg!(feature = "other_methods") { 7 } else { 2 };

    /// The methods of this crate with their default settings, in the order of a menu.
    pub fn all() -> [Self; Self::COUNT] {
        [
            Self::Rays(default()),
            Self::Progressive(default()),
            #[cfg(feature = "other_methods")]
            Self::Sweeping(default()),
            #[cfg(feature = "other_methods")]
            Self::Filtering(default()),
            #[cfg(feature = "other_methods")]
            Self::SummedArea(default()),
            #[cfg(feature = "other_methods")]
            Self::ScreenSpace(default()),
            #[cfg(feature = "other_methods")]
            Self::Directional(default()),
        ]
    }

    /// A method that another plugin brings.
    pub fn custom<S: MethodSettings + PartialEq>(settings: S) -> Self {
        Self::Custom(CustomMethod::new(settings))
    }

    /// The method's settings, whatever their type.
    pub fn settings(&self) -> &dyn MethodSettings {
        match self {
            Self::Rays(settings) => settings,
            Self::Progressive(settings) => settings,
            #[cfg(feature = "other_methods")]
            Self::Sweeping(settings) => settings,
            #[cfg(feature = "other_methods")]
            Self::Filtering(settings) => settings,
            #[cfg(feature = "other_methods")]
            Self::SummedArea(settings) => settings,
            #[cfg(feature = "other_methods")]
            Self::ScreenSpace(settings) => settings,
            #[cfg(feature = "other_methods")]
            Self::Directional(settings) => settings,
            Self::Custom(custom) => custom.settings(),
        }
    }

    /// The method's settings, if they are of this type.
    pub fn get<S: MethodSettings>(&self) -> Option<&S> {
        let settings: &dyn Any = self.settings();
        settings.downcast_ref()
    }

    /// The rays that are cast, all at once or a few in every frame.
    pub fn rays(&self) -> Option<&OcclusionRays> {
        match self {
            Self::Rays(rays) | Self::Progressive(ProgressiveRays { rays, .. }) => Some(rays),
            _ => None,
        }
    }

    /// The rays that are cast, for changing them.
    pub fn rays_mut(&mut self) -> Option<&mut OcclusionRays> {
        match self {
            Self::Rays(rays) | Self::Progressive(ProgressiveRays { rays, .. }) => Some(rays),
            _ => None,
        }
    }

    /// The method's name on command lines and in tables.
    pub fn name(&self) -> &'static str {
        self.settings().name()
    }

    /// Kind of the method: what it computes, and when.
    pub fn kind(&self) -> MethodKind {
        self.settings().kind()
    }

    /// Limits these settings to their valid ranges. The result is equal to itself, even where the settings have NaN.
    pub(crate) fn clamped(&self) -> Self {
        match self {
            Self::Rays(settings) => Self::Rays(settings.clamped()),
            Self::Progressive(settings) => Self::Progressive(settings.clamped()),
            #[cfg(feature = "other_methods")]
            Self::Filtering(settings) => Self::Filtering(settings.clamped()),
            #[cfg(feature = "other_methods")]
            Self::SummedArea(settings) => Self::SummedArea(settings.clamped()),
            #[cfg(feature = "other_methods")]
            Self::Sweeping(settings) => Self::Sweeping(settings.clamped()),
            #[cfg(feature = "other_methods")]
            Self::ScreenSpace(settings) => Self::ScreenSpace(settings.clamped()),
            #[cfg(feature = "other_methods")]
            Self::Directional(settings) => Self::Directional(settings.clamped()),
            Self::Custom(_) => self.clone(),
        }
    }

    /// The method to use where this one does not fit; `None` if there is none.
    pub(super) fn instead(&self) -> Option<(Self, OcclusionFallback)> {
        match self {
            Self::Progressive(settings) => {
                Some((Self::Rays(settings.rays), OcclusionFallback::AllRaysAtOnce))
            }
            #[cfg(feature = "other_methods")]
            Self::Sweeping(settings) => {
                let settings = settings.without_geometry_term()?;
                Some((Self::Sweeping(settings), OcclusionFallback::NoGeometryTerm))
            }
            _ => None,
        }
    }
}

impl core::str::FromStr for OcclusionMethod {
    type Err = String;

    /// A method of this crate with its default settings.
    fn from_str(name: &str) -> Result<Self, String> {
        Self::all().into_iter().find(|method| method.name() == name).ok_or_else(|| {
            let names = Self::all().map(|method| method.name()).join(", ");
            format!("unknown occlusion method `{name}`: expected one of {names}")
        })
    }
}
