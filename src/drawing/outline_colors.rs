//! The pass that shades pixels at outlines, by several rays each. It runs before any camera draws.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        diagnostic::RecordDiagnostics,
        render_resource::{
            BindGroupLayoutDescriptor, CachedComputePipelineId, ComputePassDescriptor,
            ComputePipelineDescriptor, PipelineCache, SpecializedComputePipeline,
            SpecializedComputePipelines,
        },
        renderer::RenderContext,
    },
};

use super::{
    phase::{DrawnGroups, DrawnVolumes},
    pipeline::{DrawPipeline, DrawVariant, bind_group_defs},
};
use crate::{
    diagnostics::SPAN_OUTLINES,
    render::{ExtractedScene, OutlinesOfView, VolumeRuns, VolumeWindows},
};

/// Makes the pipelines.
#[derive(Resource)]
pub(super) struct OutlineColorPipeline {
    shader: Handle<Shader>,
    layouts: [BindGroupLayoutDescriptor; 2],
}

/// Outlines to shade in this frame.
#[derive(Resource, Default)]
pub(super) struct OutlineColors(Vec<OutlineColorJob>);

/// The outlines of one volume in one view.
struct OutlineColorJob {
    pipeline: CachedComputePipelineId,
    groups: DrawnGroups,
    outlines: OutlinesOfView,
}

impl FromWorld for OutlineColorPipeline {
    fn from_world(world: &mut World) -> Self {
        Self {
            shader: load_embedded_asset!(world, "outline_colors.wgsl"),
            layouts: world.resource::<DrawPipeline>().of_outlines.clone(),
        }
    }
}

impl SpecializedComputePipeline for OutlineColorPipeline {
    type Key = DrawVariant;

    fn specialize(&self, variant: DrawVariant) -> ComputePipelineDescriptor {
        ComputePipelineDescriptor {
            label: Some("contextual_ao_outline_colors".into()),
            layout: self.layouts.to_vec(),
            shader: self.shader.clone(),
            shader_defs: bind_group_defs(0).into_iter().chain(variant.shader_defs()).collect(),
            zero_initialize_workgroup_memory: false,
            ..default()
        }
    }
}

/// Prepares the pass in views with smooth outlines.
pub(super) fn prepare_outline_colors(
    scene: Res<ExtractedScene>,
    windows: Res<VolumeWindows>,
    runs: Res<VolumeRuns>,
    drawn: Res<DrawnVolumes>,
    base: Res<OutlineColorPipeline>,
    mut pipelines: ResMut<SpecializedComputePipelines<OutlineColorPipeline>>,
    cache: Res<PipelineCache>,
    mut colors: ResMut<OutlineColors>,
) {
    colors.0.clear();
    for volume in &scene.volumes {
        let variant = DrawVariant::of(&volume.occlusion, &volume.shading, volume.by_gradient);
        if variant.has_scene_lights() {
            continue;
        }
        let jobs = windows.onto(volume.entity).iter().filter_map(|window| {
            let outlines = runs.of(volume.entity)?.outlines_of(window.view)?;
            let groups = drawn.groups_of(volume.drawn_on?)?.clone();
            Some(OutlineColorJob { pipeline: pipelines.specialize(&cache, &base, variant), groups, outlines })
        });
        colors.0.extend(jobs);
    }
}

/// Shades the outlines of all views.
pub(super) fn color_outlines(colors: Res<OutlineColors>, cache: Res<PipelineCache>, mut ctx: RenderContext) {
    if colors.0.is_empty() {
        return;
    }
    let recorder = ctx.diagnostic_recorder();
    let recorder = recorder.as_deref();
    let encoder = ctx.command_encoder();
    let span = recorder.time_span(encoder, SPAN_OUTLINES);
    let descriptor = ComputePassDescriptor { label: Some("contextual_ao_outline_colors"), ..default() };
    let mut pass = encoder.begin_compute_pass(&descriptor);
    for OutlineColorJob { pipeline, groups, outlines } in &colors.0 {
        let Some(pipeline) = cache.get_compute_pipeline(*pipeline) else {
            continue;
        };
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &groups.shaded, &[outlines.offset]);
        pass.set_bind_group(1, &groups.outlines, &[]);
        pass.dispatch_workgroups(outlines.workgroups.x, outlines.workgroups.y, 1);
    }
    drop(pass);
    span.end(encoder);
}
