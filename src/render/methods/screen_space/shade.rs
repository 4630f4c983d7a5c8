//! The passes over a view, in order, after it was drawn.

use bevy::{
    prelude::*,
    render::{
        render_resource::PipelineCache,
        renderer::{FlushCommands, RenderContext, RenderQueue, ViewQuery},
        view::ViewTarget,
    },
};

use super::{darken, passes::ScreenSpacePasses, views::ScreenSpaceViews};
use crate::{
    diagnostics::ReportChannel,
    occlusion::ScreenSpaceOcclusion,
    render::gpu::{
        compute_pass::Groups,
        frame::{Frame, TimesByClock},
    },
};

/// Shades a view, if it shows a volume with this method.
pub(crate) fn shade_view(
    view: ViewQuery<&ViewTarget>,
    views: Res<ScreenSpaceViews>,
    passes: Res<ScreenSpacePasses>,
    timing: Res<TimesByClock>,
    cache: Res<PipelineCache>,
    queue: Res<RenderQueue>,
    report: Res<ReportChannel>,
    mut before: FlushCommands,
    ctx: RenderContext,
) {
    let Some(job) = views.0.get(&view.entity()) else {
        return;
    };
    let Some(darken) = cache.get_render_pipeline(job.darken_pipeline) else {
        return;
    };
    let target = view.into_inner();
    let mut frame = Frame::of_view(ctx, &queue, &timing, &mut before);
    frame.pass(ScreenSpaceOcclusion::SPAN, [job], |encoder, job| {
        let pixels = Groups::Pixels(job.size);
        passes.surfaces.opaque(job.depth_samples).encode(encoder, [&job.opaque], pixels, &cache);
        for (groups, by_gradient) in &job.volumes {
            passes.surfaces.volume(*by_gradient).encode(encoder, groups, pixels, &cache);
        }
        passes.occlusion.encode(encoder, [&job.occlusion], pixels, &cache);
        let colors = target.get_unsampled_color_attachment();
        darken::encode(encoder, darken, &job.darken, job.viewport, colors);
    });
    frame.report(&report);
}
