//! The passes of step IV.

use bevy::{ecs::system::SystemParam, prelude::*, render::render_resource::PipelineCache};

use super::{
    clip::ClipPasses, cull_bricks::CullBricksPass, cull_superbricks::CullSuperbrickPasses,
    distances::DistancePasses, ranges::RangesPass, static_distances::StaticDistancePasses,
};

/// The passes and their pipelines.
#[derive(SystemParam)]
pub(crate) struct ClippingPasses<'w> {
    pub ranges: Res<'w, RangesPass>,
    pub static_distances: Res<'w, StaticDistancePasses>,
    pub cull_superbricks: Res<'w, CullSuperbrickPasses>,
    pub cull_bricks: Res<'w, CullBricksPass>,
    pub clip: Res<'w, ClipPasses>,
    pub distances: Res<'w, DistancePasses>,
    pub cache: Res<'w, PipelineCache>,
}

impl ClippingPasses<'_> {
    /// Whether volumes can be clipped. The first call requests all pipelines at once.
    pub fn are_ready(&self) -> bool {
        let cache = &self.cache;
        self.ranges.is_ready(cache)
            & self.static_distances.is_ready(cache)
            & self.cull_superbricks.is_ready(cache)
            & self.cull_bricks.is_ready(cache)
            & self.clip.is_ready(cache)
            & self.distances.is_ready(cache)
    }
}
