//! Dispatch of a pass over the pixels of a volume's views.

use bevy::{
    prelude::*,
    render::render_resource::{BindGroup, CommandEncoder, PipelineCache},
};

use crate::render::gpu::compute_pass::ComputePass;

/// Most views in one dispatch, `VIEWS` in WGSL.
pub(crate) const VIEWS_AT_ONCE: u32 = 16;

/// Views of a volume, with the part of each that a pass visits.
#[derive(Clone, Copy)]
pub(crate) struct ViewParts {
    /// Size of the largest part, pixels.
    pub largest: UVec2,
    /// Number of views.
    pub count: u32,
}

/// Encodes a pass over parts of views, with as many views as possible in each dispatch. Group 1 binds uniform arrays of
/// views, whose elements have the sizes `bytes`; the other groups have no offsets.
pub(crate) fn encode_views(
    pass: &ComputePass,
    encoder: &mut CommandEncoder,
    groups: &[&BindGroup],
    bytes: &[u32],
    parts: ViewParts,
    cache: &PipelineCache,
) {
    let Some(mut pass) = pass.begin(encoder, cache) else {
        return;
    };
    let tiles = (parts.largest + 7) / 8;
    for first in (0..parts.count).step_by(VIEWS_AT_ONCE as usize) {
        let offsets: Vec<u32> = bytes.iter().map(|bytes| bytes * first).collect();
        for (index, group) in (0..).zip(groups) {
            pass.set_bind_group(index, &***group, if index == 1 { &offsets } else { &[] });
        }
        let views = (parts.count - first).min(VIEWS_AT_ONCE);
        pass.dispatch_workgroups(tiles.x, tiles.y, views);
    }
}
