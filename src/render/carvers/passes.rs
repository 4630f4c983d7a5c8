//! The passes of steps II and III.

use bevy::{ecs::system::SystemParam, prelude::*, render::render_resource::PipelineCache};

use super::{count_surfaces::CountPass, dilate::DilatePasses, peel::PeelPasses};

/// The passes and their pipelines.
#[derive(SystemParam)]
pub(crate) struct CarverPasses<'w> {
    pub count: Res<'w, CountPass>,
    pub peel: Res<'w, PeelPasses>,
    pub dilate: Res<'w, DilatePasses>,
    pub cache: Res<'w, PipelineCache>,
}

impl CarverPasses<'_> {
    /// Whether carvers can be drawn and dilated. The first call requests all pipelines at once.
    pub fn are_ready(&self) -> bool {
        let cache = &self.cache;
        self.count.is_ready(cache) & self.peel.is_ready(cache) & self.dilate.is_ready(cache)
    }
}
