//! What is on the GPU for a volume, and of what: by this it is decided what has to be done.

use super::{carver_uniform::CarverUniform, clip_pass::Queue};
use crate::{clip::CoverageRule, occlusion::AmbientOcclusion, render::extract::ExtractedVolume};

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

/// What is on the GPU for a volume.
#[derive(Default)]
pub(crate) struct VolumeState {
    /// Table on the GPU.
    pub table_revision: Option<u32>,
    /// For which stride of the occlusion the ranges of bricks are there.
    pub ranges_for: Option<u32>,
    /// What opacities, and occlusion where it is valid, are of; `None` before the first.
    pub contents: Option<Contents>,
    /// What clipping put on the list of voxels to be cast.
    pub queue: Queue,
}
