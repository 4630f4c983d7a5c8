//! Variants of the pipelines that volumes are drawn by, and whether they are compiled.

use bevy::{
    pbr::{MeshPipelineKey, ViewKeyCache},
    platform::collections::HashMap,
    prelude::*,
    render::render_resource::{PipelineCache, SpecializedComputePipelines, SpecializedRenderPipelines},
};
use std::sync::{Arc, Mutex};

use super::{
    outline_colors::OutlineColorPipeline,
    pipeline::{DrawPipeline, DrawVariant},
};
use crate::render::{DeviceSupport, variants_are_ready};

/// Variants wanted so far, with whether their pipelines are ready in all views. Both worlds share them.
#[derive(Resource, Clone, Default)]
pub(super) struct DrawnVariants(Arc<Mutex<HashMap<DrawVariant, bool>>>);

impl DrawnVariants {
    /// Whether the pipelines of a variant are ready. From now on they are wanted.
    pub fn are_there_for(&self, variant: DrawVariant) -> bool {
        self.0.lock().is_ok_and(|mut variants| *variants.entry(variant).or_insert(false))
    }
}

/// Compiles the pipelines of wanted variants before a volume is drawn by them. Until then the volume is drawn as before,
/// so that no change of settings shows an empty frame.
pub(super) fn find_ready(
    variants: Res<DrawnVariants>,
    views: Res<ViewKeyCache>,
    (base, outlines): (Res<DrawPipeline>, Res<OutlineColorPipeline>),
    mut pipelines: ResMut<SpecializedRenderPipelines<DrawPipeline>>,
    mut outline_pipelines: ResMut<SpecializedComputePipelines<OutlineColorPipeline>>,
    cache: Res<PipelineCache>,
    _: Res<DeviceSupport>,
) {
    let Ok(mut variants) = variants.0.lock() else {
        return;
    };
    let views: Vec<_> = views.values().filter(|view| base.has_room_in(**view)).collect();
    for (variant, are_there) in variants.iter_mut() {
        let of_view = |view: MeshPipelineKey| {
            let others = [variant.of_the_others(), variant.of_far_samples(view)];
            others.into_iter().flatten().chain([*variant]).map(move |variant| (view, variant))
        };
        let keys = views.iter().flat_map(|view| of_view(**view));
        *are_there = variants_are_ready(&*base, &mut pipelines, keys, &cache);
        if views.iter().any(|view| variant.may_have_outlines(**view)) {
            let pipeline = outline_pipelines.specialize(&cache, &outlines, *variant);
            *are_there &= cache.get_compute_pipeline(pipeline).is_some();
        }
    }
}
