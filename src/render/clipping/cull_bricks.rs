//! Lists the bricks whose clipping may have changed, and the bricks in which only occlusion may be stale.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupLayoutEntries, PipelineCache, ShaderStages,
            binding_types::{
                storage_buffer_read_only, storage_buffer_read_only_sized, storage_buffer_sized,
                uniform_buffer,
            },
        },
        renderer::RenderDevice,
    },
};

use crate::render::{
    gpu::compute_pass::{ComputePass, PassDescriptor},
    volumes::{
        bricks::work_layout, carver_uniform::CarverUniform, clip_pass::ClipPassUniform, layouts,
        store::VolumeResources,
    },
};

/// Pass over the bricks of the listed superbricks.
#[derive(Resource, Deref)]
pub(crate) struct CullBricksPass(ComputePass);

impl FromWorld for CullBricksPass {
    fn from_world(world: &mut World) -> Self {
        let read = storage_buffer_read_only_sized(false, None);
        let own = BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                read,
                read,
                uniform_buffer::<ClipPassUniform>(false),
                storage_buffer_read_only::<Vec<CarverUniform>>(false),
                read,
                storage_buffer_sized(false, None),
            ),
        );
        let descriptor = PassDescriptor {
            name: "contextual_ao_cull_bricks",
            shader: load_embedded_asset!(world, "cull_bricks.wgsl"),
            before: vec![layouts::compute_layout()],
            own: &own,
            behind: vec![work_layout()],
            ..default()
        };
        Self(ComputePass::new(world, descriptor))
    }
}

impl CullBricksPass {
    pub fn bind_volume(
        &self,
        volume: &VolumeResources,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> Option<BindGroup> {
        let resources = (
            volume.bricks.opaque_before.as_entire_binding(),
            volume.bricks.ranges.as_entire_binding(),
            volume.pass.binding()?,
            volume.changes.binding()?,
            volume.bricks.superbrick_list.as_entire_binding(),
            volume.bricks.near_carvers.as_entire_binding(),
        );
        Some(self.bind(resources, cache, device))
    }
}
