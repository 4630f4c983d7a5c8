//! Pipelines that dim what is behind volumes that share space.

use bevy::{
    asset::load_embedded_asset,
    pbr::MeshPipelineKey,
    prelude::*,
    render::render_resource::{
        CompareFunction, DepthStencilState, RenderPipelineDescriptor, SpecializedRenderPipeline,
    },
};

use crate::drawing::pipeline::{DrawPipeline, depth_of_shader};

/// Makes the pipelines, one for each kind of view.
#[derive(Resource)]
pub(in crate::drawing) struct DimmingPipeline {
    drawing: DrawPipeline,
    shader: Handle<Shader>,
}

impl FromWorld for DimmingPipeline {
    fn from_world(world: &mut World) -> Self {
        Self {
            drawing: world.resource::<DrawPipeline>().clone(),
            shader: load_embedded_asset!(world, "dimming.wgsl"),
        }
    }
}

impl SpecializedRenderPipeline for DimmingPipeline {
    type Key = MeshPipelineKey;

    fn specialize(&self, view: MeshPipelineKey) -> RenderPipelineDescriptor {
        let mut descriptor = self.drawing.describe("contextual_ao_dimming", &self.shader, view, []);
        descriptor.layout.push(self.drawing.merged_layout.clone());
        // Faces are drawn whatever is in front of them. The shader itself ends at opaque geometry.
        descriptor.depth_stencil = Some(DepthStencilState {
            depth_write_enabled: Some(false),
            depth_compare: Some(CompareFunction::Always),
            ..depth_of_shader()
        });
        descriptor
    }
}
