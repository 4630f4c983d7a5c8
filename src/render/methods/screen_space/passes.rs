//! The compute passes over a view.

use bevy::{prelude::*, render::render_resource::PipelineCache};

use super::{occlusion::OcclusionPass, surfaces::SurfacePasses};
use crate::render::gpu::compute_pass::are_ready;

/// The passes, in order.
#[derive(Resource)]
pub(super) struct ScreenSpacePasses {
    pub surfaces: SurfacePasses,
    pub occlusion: OcclusionPass,
}

impl FromWorld for ScreenSpacePasses {
    fn from_world(world: &mut World) -> Self {
        Self { surfaces: SurfacePasses::from_world(world), occlusion: OcclusionPass::from_world(world) }
    }
}

impl ScreenSpacePasses {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        are_ready(self.surfaces.all().chain([&*self.occlusion]), cache)
    }
}
