//! State of a volume's data on the GPU, from which the work of a frame is planned.

use super::{carver_uniform::CarverUniform, clip_pass::Queue};
use crate::{
    clip::CoverageRule,
    occlusion::{AmbientOcclusion, Reconstruction},
    render::extract::ExtractedVolume,
};

/// Inputs of opacities and occlusion, besides the volume itself.
#[derive(Clone, PartialEq)]
pub(crate) struct Contents {
    pub table_revision: u32,
    /// Whether opacities follow the gradient.
    pub by_gradient: bool,
    pub occlusion: AmbientOcclusion,
    pub coverage: CoverageRule,
    /// The carvers that act, each with the revision of its maps.
    pub carvers: Vec<(CarverUniform, u64)>,
}

impl Contents {
    pub fn of(volume: &ExtractedVolume, carvers: Vec<(CarverUniform, u64)>, coverage: CoverageRule) -> Self {
        Self {
            table_revision: volume.table.revision,
            by_gradient: volume.by_gradient,
            occlusion: volume.occlusion.clone(),
            coverage,
            carvers,
        }
    }

    /// Whether only the transfer function changed.
    pub fn differs_in_table_alone(&self, new: &Self) -> bool {
        (self.table_revision, self.by_gradient) != (new.table_revision, new.by_gradient)
            && self.occlusion == new.occlusion
            && self.coverage == new.coverage
            && self.carvers == new.carvers
    }

    /// Whether only the settings of the occlusion method changed.
    pub fn differs_in_method_alone(&self, new: &Self) -> bool {
        let method = new.occlusion.method.clone();
        self.occlusion.method != method
            && *new
                == Self { occlusion: AmbientOcclusion { method, ..self.occlusion.clone() }, ..self.clone() }
    }
}

/// What tells the pipelines that follow view rays apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct MarchVariant {
    pub reconstruction: Reconstruction,
    /// Whether the transfer function follows the gradient.
    pub by_gradient: bool,
}

impl MarchVariant {
    pub fn of(volume: &ExtractedVolume) -> Self {
        Self { reconstruction: volume.shading.reconstruction, by_gradient: volume.by_gradient }
    }

    /// Shader definitions of the pipelines.
    pub fn shader_defs(self) -> impl Iterator<Item = &'static str> {
        let tricubic = self.reconstruction.is_tricubic().then_some("TRICUBIC");
        tricubic.into_iter().chain(self.by_gradient.then_some("BY_GRADIENT"))
    }
}

/// State of a volume's data on the GPU.
#[derive(Default)]
pub(crate) struct VolumeState {
    /// How the views were last marched.
    pub marched: Option<MarchVariant>,
    /// Stride of the occlusion for which the ranges of bricks were found.
    pub ranges_for: Option<u32>,
    /// Inputs of the present opacities, and of occlusion where it is valid. `None` before these are first computed.
    pub contents: Option<Contents>,
    /// Voxels that clipping put on the list of voxels to be cast.
    pub queue: Queue,
    /// Number of clippings so far.
    pub clippings: u32,
    /// Tells apart what is seen of the volume: it changes with every change.
    pub revision: u32,
}
