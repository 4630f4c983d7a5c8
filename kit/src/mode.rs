//! Shading modes: one name for a look and its recomputation, on command lines and in tables.

use bevy_contextual_ao::{occlusion::Recompute, prelude::*};
use core::str::FromStr;

/// The look of a volume, and the part of its occlusion that is recomputed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ShadingMode {
    /// Colour alone.
    Solid,
    /// Lit.
    Phong,
    /// Occluded; changed occlusion is recomputed.
    #[default]
    Cao,
    /// Lit and occluded; changed occlusion is recomputed.
    PhongCao,
    /// Occluded; all occlusion is recomputed in every frame.
    Lao,
}

impl ShadingMode {
    /// All modes, in the order of a menu.
    pub const ALL: [Self; 5] = [Self::Solid, Self::Phong, Self::Cao, Self::PhongCao, Self::Lao];

    /// Mode of these settings.
    pub fn of(shading: &VolumeShading, occlusion: &AmbientOcclusion) -> Self {
        let is_lit = shading.lighting == VolumeLighting::Headlight;
        match (shading.ambient_occlusion, is_lit, occlusion.recompute) {
            (true, _, Recompute::Everything) => Self::Lao,
            (true, true, _) => Self::PhongCao,
            (true, false, _) => Self::Cao,
            (false, true, _) => Self::Phong,
            (false, false, _) => Self::Solid,
        }
    }

    /// Sets a volume's settings to this mode.
    pub fn apply(self, shading: &mut VolumeShading, occlusion: &mut AmbientOcclusion) {
        shading.lighting = if self.uses_light() { VolumeLighting::Headlight } else { VolumeLighting::Unlit };
        shading.ambient_occlusion = self.uses_occlusion();
        occlusion.recompute = if self.recomputes_all() { Recompute::Everything } else { Recompute::Changed };
    }

    /// Whether samples are darkened by ambient occlusion.
    pub fn uses_occlusion(self) -> bool {
        matches!(self, Self::Cao | Self::PhongCao | Self::Lao)
    }

    /// Whether samples are lit.
    pub fn uses_light(self) -> bool {
        matches!(self, Self::Phong | Self::PhongCao)
    }

    /// Whether every voxel is recomputed every frame.
    pub fn recomputes_all(self) -> bool {
        self == Self::Lao
    }

    /// The name: `solid`, `phong`, `cao`, `phong_cao`, `lao`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Solid => "solid",
            Self::Phong => "phong",
            Self::Cao => "cao",
            Self::PhongCao => "phong_cao",
            Self::Lao => "lao",
        }
    }
}

impl FromStr for ShadingMode {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|mode| mode.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("unknown shading mode `{name}`: expected one of {names}")
        })
    }
}
