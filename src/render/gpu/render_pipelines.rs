//! Variants of render pipelines that are compiled before they are drawn with.

use bevy::render::render_resource::{PipelineCache, SpecializedRenderPipeline, SpecializedRenderPipelines};

/// Whether the variants of some keys are there. All are compiled from the first time on that this is asked.
pub(crate) fn variants_are_ready<P: SpecializedRenderPipeline>(
    base: &P,
    variants: &mut SpecializedRenderPipelines<P>,
    keys: impl Iterator<Item = P::Key>,
    cache: &PipelineCache,
) -> bool {
    let ids = keys.map(|key| variants.specialize(cache, base, key));
    ids.filter(|id| cache.get_render_pipeline(*id).is_none()).count() == 0
}
