//! The components that say how a volume is shaded.

use bevy::{math::DVec3, prelude::*};

use super::RayPattern;
use crate::volume::VolumeGeometry;

/// How the ambient occlusion of a volume is computed (required by
/// [`Volume3d`](crate::volume::Volume3d)).
///
/// A change recomputes the occlusion of all voxels that are seen, in the same frame.
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct AmbientOcclusion {
    /// The directions in which a voxel looks. More rays cost proportionally more time and lower
    /// the error; few rays show as bands in smooth regions.
    pub pattern: RayPattern,
    /// Samples per ray. More reach farther and cost proportionally more time per recomputed voxel;
    /// a carver then also makes more voxels recompute. At most [`Self::MOST_STEPS`].
    pub steps: u32,
    /// Distance between samples, millimetres. Longer steps reach farther for the same cost and may
    /// step over structures thinner than themselves. At most [`Self::LONGEST_STEP_MM`].
    pub step_mm: f32,
}

impl Default for AmbientOcclusion {
    fn default() -> Self {
        Self { pattern: RayPattern::default(), steps: 20, step_mm: 1.0 }
    }
}

impl AmbientOcclusion {
    /// The most samples per ray; more are not taken.
    pub const MOST_STEPS: u32 = 4096;
    /// The longest distance between samples, mm.
    pub const LONGEST_STEP_MM: f32 = 1000.0;

    /// These settings within what can be computed.
    pub(crate) fn clamped(&self) -> Self {
        let step_mm = if self.step_mm.is_finite() { self.step_mm } else { 0.0 };
        Self {
            pattern: self.pattern,
            steps: self.steps.min(Self::MOST_STEPS),
            step_mm: step_mm.clamp(0.0, Self::LONGEST_STEP_MM),
        }
    }

    /// Distance of the first sample from the voxel centre, mm: one voxel diagonal.
    pub fn start_mm(spacing_mm: DVec3) -> f64 {
        spacing_mm.length()
    }

    /// The farthest distance, mm, at which clipping can change a voxel's occlusion: the farthest
    /// sample, its trilinear footprint (one voxel diagonal) and the coverage footprint.
    pub fn reach_mm(&self, geometry: &VolumeGeometry) -> f64 {
        let ray = if self.steps == 0 {
            0.0
        } else {
            Self::start_mm(geometry.spacing_mm) + (self.steps - 1) as f64 * self.step_mm.max(0.0) as f64
        };
        ray + geometry.cell_diagonal_mm() + Self::footprint_mm(geometry)
    }

    /// Distance, mm, within which lie all points whose clipping decides a voxel's coverage, and all
    /// that read the voxel: 1.025 voxel diagonals for the published points (supplementary notes to
    /// the paper's algorithm 2); the lines reach 1.095 voxels in two directions and 1 in the third,
    /// whichever way the clip camera looks.
    pub fn footprint_mm(geometry: &VolumeGeometry) -> f64 {
        let lines = DVec3::new(1.095, 1.095, 1.0).length() * geometry.longest_stretch_mm();
        lines.max(1.025 * geometry.cell_diagonal_mm())
    }
}

/// How a volume is drawn (required by [`Volume3d`](crate::volume::Volume3d)).
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct VolumeShading {
    /// What shades a sample.
    pub mode: ShadingMode,
    /// Distance between samples along a view ray, in units of the smallest voxel spacing. Smaller
    /// steps cost proportionally more drawing time and show fewer slices.
    pub step_voxels: f32,
    /// Moves the start of every view ray by a fixed pattern, which turns slices into noise.
    pub jitter: bool,
}

impl Default for VolumeShading {
    fn default() -> Self {
        Self { mode: ShadingMode::default(), step_voxels: 0.5, jitter: true }
    }
}

/// What shades the samples of a volume.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
pub enum ShadingMode {
    /// The transfer function's colour alone.
    Solid,
    /// Blinn-Phong with a light at the camera; gradients of the clipped opacity.
    Phong,
    /// Contextual ambient occlusion: only what a carver can have changed, and a view reads, is
    /// recomputed.
    #[default]
    Cao,
    /// Blinn-Phong, and its ambient and diffuse parts darkened by contextual ambient occlusion.
    PhongCao,
    /// Local ambient occlusion of every voxel, recomputed every frame: the reference for
    /// [`ShadingMode::Cao`], which gives the same image. It is one dispatch: for large volumes and
    /// many rays a driver's watchdog may end it.
    Lao,
}

impl ShadingMode {
    /// All modes, in the order of a menu.
    pub const ALL: [Self; 5] = [Self::Solid, Self::Phong, Self::Cao, Self::PhongCao, Self::Lao];

    /// Whether samples are darkened by ambient occlusion.
    pub fn uses_occlusion(self) -> bool {
        matches!(self, Self::Cao | Self::PhongCao | Self::Lao)
    }

    /// Whether samples are lit by Blinn-Phong.
    pub fn uses_light(self) -> bool {
        matches!(self, Self::Phong | Self::PhongCao)
    }

    /// Whether every voxel is recomputed every frame.
    pub fn recomputes_all(self) -> bool {
        self == Self::Lao
    }

    /// The name used on command lines and in tables: `solid`, `phong`, `cao`, `phong_cao`, `lao`.
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

impl core::str::FromStr for ShadingMode {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|mode| mode.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("unknown shading mode `{name}`: expected one of {names}")
        })
    }
}
