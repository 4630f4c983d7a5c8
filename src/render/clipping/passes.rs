//! The passes of step IV.

use bevy::{ecs::system::SystemParam, prelude::*, render::render_resource::PipelineCache};

use super::{clip::ClipPasses, cull::CullPass, distances::DistancePasses, ranges::RangesPass};

/// The passes and their pipelines.
#[derive(SystemParam)]
pub(crate) struct ClippingPasses<'w> {
    pub ranges: Res<'w, RangesPass>,
    pub cull: Res<'w, CullPass>,
    pub clip: Res<'w, ClipPasses>,
    pub distances: Res<'w, DistancePasses>,
    pub cache: Res<'w, PipelineCache>,
}

impl ClippingPasses<'_> {
    /// Whether volumes can be clipped. The first call requests all pipelines at once.
    pub fn are_ready(&self) -> bool {
        let cache = &self.cache;
        self.ranges.is_ready(cache)
            & self.cull.is_ready(cache)
            & self.clip.is_ready(cache)
            & self.distances.is_ready(cache)
    }
}
