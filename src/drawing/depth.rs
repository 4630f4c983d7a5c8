//! Depths of volumes that have a [`VolumeDepth`](crate::occlusion::VolumeDepth), in the depth of the main pass: for what is
//! drawn later, and for passes behind the main pass, such as Bevy's depth of field and volumetric fog.
//!
//! A volume's depth is drawn right behind its colours, among the transparent objects. Volumes read the depth of the prepass,
//! so that none ends its own rays.

use bevy::{
    asset::load_embedded_asset,
    pbr::MeshPipelineKey,
    prelude::*,
    render::render_resource::{ColorWrites, RenderPipelineDescriptor, SpecializedRenderPipeline},
};

use super::pipeline::{DrawPipeline, FollowedRays, depth_of_shader};

/// Makes the pipelines.
#[derive(Resource)]
pub(super) struct DepthPipeline {
    drawing: DrawPipeline,
    shader: Handle<Shader>,
}

/// Kind of a view, and how its rays are followed.
type DepthKey = (MeshPipelineKey, FollowedRays);

impl FromWorld for DepthPipeline {
    fn from_world(world: &mut World) -> Self {
        let drawing = world.resource::<DrawPipeline>().clone();
        Self { drawing, shader: load_embedded_asset!(world, "depth.wgsl") }
    }
}

impl SpecializedRenderPipeline for DepthPipeline {
    type Key = DepthKey;

    fn specialize(&self, (view, rays): DepthKey) -> RenderPipelineDescriptor {
        let own = rays.shader_defs();
        let mut descriptor = self.drawing.describe("contextual_ao_depth", &self.shader, view, own);
        // The pass has colours, which stay.
        for target in
            descriptor.fragment.iter_mut().flat_map(|fragment| fragment.targets.iter_mut().flatten())
        {
            (target.blend, target.write_mask) = (None, ColorWrites::empty());
        }
        descriptor.depth_stencil = Some(depth_of_shader());
        descriptor
    }
}
