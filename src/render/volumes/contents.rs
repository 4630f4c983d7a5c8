//! State of a volume's data on the GPU, from which the work of a frame is planned.

use super::{carver_uniform::CarverUniform, clip_pass::Queue, preintegration::StepLengths};
use crate::{
    clip::CoverageRule,
    occlusion::{AmbientOcclusion, Reconstruction},
    render::extract::ExtractedVolume,
};

/// Inputs of opacities and occlusion, besides the volume itself.
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

    /// Whether only the transfer function changed.
    pub fn differs_in_table_alone(&self, new: &Self) -> bool {
        self.table_revision != new.table_revision
            && self.occlusion == new.occlusion
            && self.coverage == new.coverage
            && self.carvers == new.carvers
    }
}

/// State of a volume's data on the GPU.
#[derive(Default)]
pub(crate) struct VolumeState {
    /// Revision of the lookup table on the GPU.
    pub table_revision: Option<u32>,
    /// The table's revision and the lengths of steps for its integrals on the GPU.
    pub integrated: Option<(u32, StepLengths)>,
    /// Filter with which the views were last marched.
    pub reconstruction: Option<Reconstruction>,
    /// Stride of the occlusion for which the ranges of bricks were found.
    pub ranges_for: Option<u32>,
    /// Inputs of the present opacities, and of occlusion where it is valid. `None` before these are first computed.
    pub contents: Option<Contents>,
    /// Voxels that clipping put on the list of voxels to be cast.
    pub queue: Queue,
    /// Number of clippings so far.
    pub clippings: u32,
}
