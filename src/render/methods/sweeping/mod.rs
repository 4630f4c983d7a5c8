//! Fast occlusion sweeping (Singh, Yuksel, House 2009). Light goes from voxel to voxel through the whole volume, in
//! a sweep for each octant of directions. The same sweeps find a distance field.
//!
//! A single light comes through a grid turned towards it (section 4.1).
//!
//! A sweep goes over tiles of 8x8x8 voxels. Tiles in a plane across the sweep's diagonal do not depend on each other.
//! Each plane is one dispatch, and the planes follow one another.

mod geometry_term;
mod passes;
mod planes;
pub(in crate::render) mod resources;
mod sweeps;

use bevy::{
    asset::embedded_asset,
    prelude::*,
    render::{
        extract_resource::ExtractResourcePlugin,
        render_resource::{Buffer, PipelineCache},
    },
    shader::load_shader_library,
};

#[cfg(test)]
pub(in crate::render) use geometry_term::SIDE;
#[cfg(test)]
pub(in crate::render) use planes::SweepPlane;

use super::{
    registry::VoxelMethodPlugin,
    voxel_method::{KeptVolume, VolumeFrame, VoxelMethod},
};
use crate::{
    occlusion::{OcclusionMethod, OcclusionSweeping, SweepDistancesAlone},
    render::{
        gpu::{device::Gpu, frame::Frame},
        volumes::store::VolumeStore,
    },
};
use passes::{SweepJob, SweepPasses};
use resources::{Computed, SweepResources};

/// Adds the method.
pub(super) struct SweepingPlugin;

impl Plugin for SweepingPlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "sweeping.wgsl");
        embedded_asset!(app, "isosurface.wgsl");
        embedded_asset!(app, "sweep.wgsl");
        embedded_asset!(app, "collect.wgsl");
        embedded_asset!(app, "surface.wgsl");
        app.add_plugins((
            ExtractResourcePlugin::<SweepDistancesAlone>::default(),
            VoxelMethodPlugin::<Sweeping>::default(),
        ));
    }
}

/// The passes, and whether they leave out the light.
pub(super) struct Sweeping {
    passes: SweepPasses,
    distances_alone: bool,
}

impl FromWorld for Sweeping {
    fn from_world(world: &mut World) -> Self {
        Self { passes: SweepPasses::from_world(world), distances_alone: false }
    }
}

impl VoxelMethod for Sweeping {
    type Kept = SweepResources;
    type Job = SweepJob;

    fn computes(&self, method: &OcclusionMethod) -> bool {
        method.get::<OcclusionSweeping>().is_some()
    }

    fn is_ready(&self, _: &OcclusionMethod, cache: &PipelineCache) -> bool {
        self.passes.are_ready(cache)
    }

    fn read(&mut self, world: &World) {
        self.distances_alone = world.get_resource::<SweepDistancesAlone>().is_some_and(|alone| alone.0);
    }

    fn keep(&self, kept: Option<SweepResources>, volume: &KeptVolume, gpu: &Gpu) -> SweepResources {
        SweepResources::kept(kept, volume, gpu)
    }

    fn plan(&self, kept: &mut SweepResources, volume: &VolumeFrame, gpu: &Gpu) -> Option<SweepJob> {
        let needed = if volume.uses_occlusion() {
            Computed::Occlusion
        } else if kept.surface.is_some() {
            Computed::Distances
        } else {
            Computed::Nothing
        };
        // A surface at an isovalue and its occlusion do not depend on the transfer function.
        let keeps_surface = kept.distances.is_some() && volume.step.changes_table_alone;
        if volume.has_changed() && !keeps_surface {
            kept.computed = Computed::Nothing;
        }
        if kept.computed >= needed {
            return None;
        }
        let distances_alone = self.distances_alone || needed == Computed::Distances;
        let job = self.passes.bind_volume(volume.resources, kept, volume.group(), distances_alone, gpu)?;
        kept.computed = needed;
        Some(job)
    }

    fn encode(&self, jobs: &[SweepJob], frame: &mut Frame, cache: &PipelineCache) {
        frame.pass(OcclusionSweeping::SPAN, jobs, |encoder, job| self.passes.encode(encoder, job, cache));
    }
}

impl VolumeStore {
    /// Signed distances of all voxels from the surface, for a volume swept by an isovalue
    /// ([`SweepingSurface`](crate::occlusion::SweepingSurface)): 32-bit floats, mm, x fastest. They are below 0 inside,
    /// 1e18 or -1e18 where there is no surface, and as if the grid's axes were perpendicular.
    pub fn signed_distances(&self, volume: Entity) -> Option<&Buffer> {
        self.kept::<SweepResources>(volume)?.distances.as_ref()
    }
}
