//! What is on the device for a volume, and of what: by this it is decided what has to be done.

use super::{
    carver_uniform::CarverUniform,
    pass_uniforms::{Queue, WindowUniform},
};
use crate::{
    clip::CoverageRule,
    occlusion::{AmbientOcclusion, OcclusionResolution},
    render::extract::ExtractedVolume,
};

/// What opacities and occlusion depend on, besides the volume itself.
#[derive(Clone, PartialEq)]
pub(crate) struct Contents {
    pub table_revision: u32,
    pub occlusion: AmbientOcclusion,
    pub coverage: CoverageRule,
    /// The carvers that act, each with the revision of its maps.
    pub carvers: Vec<(CarverUniform, u64)>,
}

impl Contents {
    pub fn of(volume: &ExtractedVolume, carvers: Vec<(CarverUniform, u64)>, coverage: CoverageRule) -> Self {
        Self { table_revision: volume.table.revision, occlusion: volume.occlusion.clone(), coverage, carvers }
    }

    /// Whether the transfer function is all that changed.
    pub fn differs_in_table_alone(&self, new: &Self) -> bool {
        self.table_revision != new.table_revision
            && self.occlusion == new.occlusion
            && self.coverage == new.coverage
            && self.carvers == new.carvers
    }
}

/// How far rays are that are cast in several frames.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RayProgress {
    pub rays: u32,
    pub weight: f32,
}

/// What a method that computes all voxels has computed: each includes the one before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Computed {
    #[default]
    Nothing,
    /// The distance field of a surface, where that is drawn.
    Distances,
    Occlusion,
}

/// What is on the device for a volume.
#[derive(Default)]
pub(crate) struct VolumeState {
    /// Table on the device.
    pub table_revision: Option<u32>,
    /// Whether the geometry term of octants is behind it.
    pub has_geometry_term: bool,
    /// What the rays on the device were made for.
    pub rays_for: Option<AmbientOcclusion>,
    /// For which resolution of the occlusion the ranges of bricks are there.
    pub ranges_for: Option<OcclusionResolution>,
    /// What opacities, and occlusion where it is valid, are of; `None` before the first.
    pub contents: Option<Contents>,
    /// Which rays have been cast since the last change, and the weight of all that was found.
    pub progress: RayProgress,
    /// What a method that computes all voxels has done since the last change.
    pub computed: Computed,
    /// What was cast without being asked for.
    pub queue: Queue,
    /// Views for which all occlusion that they read is valid.
    pub marked: Vec<WindowUniform>,
}
