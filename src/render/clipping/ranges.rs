//! Range of intensities around every brick, found once per volume and stride of the occlusion.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupLayoutEntries, PipelineCache, ShaderStages,
            binding_types::storage_buffer_sized,
        },
        renderer::RenderDevice,
    },
};

use crate::render::{
    gpu::compute_pass::{ComputePass, PassDescriptor},
    volumes::{layouts, store::VolumeResources},
};

/// Pass over all bricks.
#[derive(Resource, Deref)]
pub(crate) struct RangesPass(ComputePass);

impl FromWorld for RangesPass {
    fn from_world(world: &mut World) -> Self {
        let own = BindGroupLayoutEntries::single(ShaderStages::COMPUTE, storage_buffer_sized(false, None));
        let descriptor = PassDescriptor {
            name: "contextual_ao_ranges",
            shader: load_embedded_asset!(world, "ranges.wgsl"),
            before: vec![layouts::compute_layout()],
            own: &own,
            ..default()
        };
        Self(ComputePass::new(world, descriptor))
    }
}

impl RangesPass {
    pub fn bind_volume(
        &self,
        volume: &VolumeResources,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> BindGroup {
        self.bind((volume.bricks.ranges.as_entire_binding(),), cache, device)
    }
}
