//! Occlusion by summed-area tables (Díaz et al. 2010; Schlegel, Makhinya, Pajarola 2011): mean opacities of boxes around
//! every voxel, and of their shells. `table` sums the opacities after each of their changes, and `boxes` evaluates the
//! sums. A change of settings evaluates the same table anew.

mod boxes;
mod resources;
mod table;

use bevy::{
    asset::embedded_asset,
    prelude::*,
    render::render_resource::{BindGroup, PipelineCache},
};

#[cfg(test)]
pub(in crate::render) use resources::Shell;

use super::{
    registry::VoxelMethodPlugin,
    voxel_method::{KeptVolume, VolumeFrame, VoxelMethod},
};
use crate::{
    occlusion::{OcclusionMethod, SummedAreaOcclusion},
    render::gpu::{compute_pass::Groups, device::Gpu, frame::Frame},
};
use boxes::BoxesPass;
use resources::SummedAreaResources;
use table::TablePasses;

/// Adds the method.
pub(super) struct SummedAreaPlugin;

impl Plugin for SummedAreaPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "table.wgsl");
        embedded_asset!(app, "boxes.wgsl");
        app.add_plugins(VoxelMethodPlugin::<SummedArea>::default());
    }
}

/// The passes.
pub(super) struct SummedArea {
    table: TablePasses,
    boxes: BoxesPass,
}

/// The passes over one volume.
pub(super) struct SummedAreaJob {
    volume: BindGroup,
    /// `None` if the table is up to date.
    table: Option<BindGroup>,
    boxes: BindGroup,
    dimensions: UVec3,
}

impl FromWorld for SummedArea {
    fn from_world(world: &mut World) -> Self {
        Self { table: TablePasses::from_world(world), boxes: BoxesPass::from_world(world) }
    }
}

impl VoxelMethod for SummedArea {
    type Kept = SummedAreaResources;
    type Job = SummedAreaJob;

    fn computes(&self, method: &OcclusionMethod) -> bool {
        method.get::<SummedAreaOcclusion>().is_some()
    }

    fn is_ready(&self, _: &OcclusionMethod, cache: &PipelineCache) -> bool {
        // Both are asked, so that all are compiled at once.
        self.table.are_ready(cache) & self.boxes.is_ready(cache)
    }

    fn keep(&self, kept: Option<SummedAreaResources>, volume: &KeptVolume, gpu: &Gpu) -> SummedAreaResources {
        kept.unwrap_or_else(|| SummedAreaResources::new(volume.dimensions(), &gpu.device))
    }

    fn plan(&self, kept: &mut SummedAreaResources, volume: &VolumeFrame, gpu: &Gpu) -> Option<SummedAreaJob> {
        if volume.has_changed() {
            kept.has_factors = false;
            kept.has_table &= volume.step.changes_method_alone;
        }
        if kept.has_factors || !volume.uses_occlusion() {
            return None;
        }
        let boxes = self.boxes.bind_volume(volume, kept, gpu)?;
        let table = (!kept.has_table).then(|| self.table.bind_volume(volume, &kept.table, gpu));
        kept.has_table = true;
        kept.has_factors = true;
        Some(SummedAreaJob { volume: volume.group().clone(), table, boxes, dimensions: volume.dimensions() })
    }

    fn encode(&self, jobs: &[SummedAreaJob], frame: &mut Frame, cache: &PipelineCache) {
        let sums = jobs.iter().filter_map(|job| Some((job, job.table.as_ref()?)));
        frame.pass(SummedAreaOcclusion::SPAN_TABLE, sums, |encoder, (job, table)| {
            self.table.encode(encoder, [&job.volume, table], job.dimensions, cache);
        });
        frame.pass(SummedAreaOcclusion::SPAN_BOXES, jobs, |encoder, job| {
            let voxels = Groups::Voxels(job.dimensions);
            self.boxes.encode(encoder, [&job.volume, &job.boxes], voxels, cache);
        });
    }
}
