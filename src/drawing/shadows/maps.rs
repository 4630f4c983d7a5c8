//! Draws kept depths into Bevy's shadow maps.

use bevy::{
    asset::load_embedded_asset,
    core_pipeline::FullscreenShader,
    pbr::{ShadowView, ViewLightEntities},
    prelude::*,
    render::{
        render_resource::{
            CachedRenderPipelineId, FragmentState, PipelineCache, RenderPassDescriptor,
            RenderPipelineDescriptor, StoreOp,
        },
        renderer::{RenderContext, ViewQuery},
    },
};

use super::depths::{ShadowPipeline, Shadows};
use crate::drawing::pipeline::{bind_group_defs, depth_of_shader};

/// The pipeline.
#[derive(Resource)]
pub(super) struct ShadowMapPipeline {
    pipeline: CachedRenderPipelineId,
}

impl FromWorld for ShadowMapPipeline {
    fn from_world(world: &mut World) -> Self {
        let layout = world.resource::<ShadowPipeline>().of_maps.clone();
        let shader: Handle<Shader> = load_embedded_asset!(world, "maps.wgsl");
        let shader_defs = bind_group_defs(0).to_vec();
        let pipeline = world.resource::<PipelineCache>().queue_render_pipeline(RenderPipelineDescriptor {
            label: Some("contextual_ao_shadow_map".into()),
            layout: vec![layout],
            vertex: world.resource::<FullscreenShader>().to_vertex_state(),
            fragment: Some(FragmentState { shader, shader_defs, ..default() }),
            depth_stencil: Some(depth_of_shader()),
            ..default()
        });
        Self { pipeline }
    }
}

/// Draws the shadows of volumes behind those of meshes: into the maps of a camera's directional lights, or into that of a
/// point or spot light.
pub(super) fn draw_shadows(
    view: ViewQuery<(Entity, Option<&ViewLightEntities>)>,
    maps: Query<&ShadowView>,
    shadows: Res<Shadows>,
    base: Res<ShadowMapPipeline>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let Some(pipeline) = cache.get_render_pipeline(base.pipeline) else {
        return;
    };
    let (view, lights) = view.into_inner();
    let own = [view];
    for light in lights.map_or(&own[..], |lights| &lights.lights) {
        let (Some(jobs), Ok(map)) = (shadows.jobs.get(light), maps.get(*light)) else {
            continue;
        };
        let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
            label: Some("contextual_ao_shadow_map"),
            depth_stencil_attachment: Some(map.depth_attachment.get_attachment(StoreOp::Store)),
            ..default()
        });
        pass.set_render_pipeline(pipeline);
        for job in jobs {
            let (first, size) = (job.first.as_vec2(), job.size.as_vec2());
            pass.set_bind_group(0, &job.group, &[job.offset]);
            pass.set_viewport(first.x, first.y, size.x, size.y, 0.0, 1.0);
            pass.draw(0..3, 0..1);
        }
    }
}
