//! All passes, in the order in which they run in a frame.

use bevy::{ecs::system::SystemParam, prelude::*, render::render_resource::PipelineCache};

use super::{
    carvers::{count_surfaces::CountPass, dilate::DilatePasses, peel::PeelPasses},
    clipping::{clip::ClipPasses, cull::CullPass, distances::DistancePasses, ranges::RangesPass},
    methods::{
        direct::DirectPasses,
        filtering::FilteringPasses,
        rays::{mark::MarkPass, ray_cast::RayCastPasses},
        screen_space::ScreenSpacePasses,
        sweeping::SweepPasses,
    },
};
use crate::occlusion::OcclusionMethod;

/// The passes and their pipelines.
#[derive(SystemParam)]
pub(crate) struct Passes<'w> {
    pub count: Res<'w, CountPass>,
    pub peel: Res<'w, PeelPasses>,
    pub dilate: Res<'w, DilatePasses>,
    pub ranges: Res<'w, RangesPass>,
    pub cull: Res<'w, CullPass>,
    pub clip: Res<'w, ClipPasses>,
    pub distances: Res<'w, DistancePasses>,
    pub filtering: Res<'w, FilteringPasses>,
    pub mark: Res<'w, MarkPass>,
    pub ray_cast: Res<'w, RayCastPasses>,
    pub sweep: Res<'w, SweepPasses>,
    pub screen_space: Res<'w, ScreenSpacePasses>,
    pub direct: Res<'w, DirectPasses>,
    pub cache: Res<'w, PipelineCache>,
}

impl Passes<'_> {
    /// Whether carvers can be drawn and dilated.
    pub fn over_carvers_are_ready(&self) -> bool {
        let cache = &self.cache;
        self.count.is_ready(cache) & self.peel.is_ready(cache) & self.dilate.is_ready(cache)
    }

    /// Whether volumes can be clipped, and shaded by a method, their work being counted or not: others are not
    /// waited for.
    pub fn are_ready_for(&self, method: &OcclusionMethod, counts_work: bool) -> bool {
        let cache = &self.cache;
        let of_method = match method {
            OcclusionMethod::Rays => true,
            OcclusionMethod::Progressive(_) => self.ray_cast.progressive_is_ready(cache),
            OcclusionMethod::Sweeping(_) => self.sweep.is_ready(cache),
            OcclusionMethod::Filtering(_) => self.filtering.is_ready(cache),
            OcclusionMethod::ScreenSpace(_) => self.screen_space.is_ready(cache),
            OcclusionMethod::Direct(_) => self.direct.is_ready(cache),
        };
        // Each is asked, whatever the others say, so that all are compiled at once.
        self.ranges.is_ready(cache)
            & self.cull.is_ready(cache)
            & self.clip.is_ready(cache)
            & self.distances.is_ready(cache)
            & self.mark.is_ready(cache)
            & self.ray_cast.is_ready(counts_work, cache)
            & of_method
    }
}
