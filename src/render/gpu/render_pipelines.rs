//! Compilation of render pipeline variants before their first use.

use bevy::render::render_resource::{PipelineCache, SpecializedRenderPipeline, SpecializedRenderPipelines};

/// Whether the variants of all `keys` are compiled. The first call starts their compilation.
pub(crate) fn variants_are_ready<P: SpecializedRenderPipeline>(
    base: &P,
    variants: &mut SpecializedRenderPipelines<P>,
    keys: impl Iterator<Item = P::Key>,
    cache: &PipelineCache,
) -> bool {
    let ids = keys.map(|key| variants.specialize(cache, base, key));
    ids.filter(|id| cache.get_render_pipeline(*id).is_none()).count() == 0
}
