//! Lists the bricks whose clipping may have changed, and the bricks in which only occlusion may be stale.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupLayoutEntries, PipelineCache, ShaderStages, StorageTextureAccess,
            binding_types::{
                storage_buffer_read_only, storage_buffer_read_only_sized, texture_storage_3d, uniform_buffer,
            },
        },
        renderer::RenderDevice,
    },
};

use crate::render::{
    gpu::compute_pass::{ComputePass, PassDescriptor},
    volumes::{
        bricks::{BRICK_FORMAT, work_layout},
        carver_uniform::CarverUniform,
        clip_pass::ClipPassUniform,
        layouts,
        store::VolumeResources,
    },
};

/// Pass over all bricks.
#[derive(Resource, Deref)]
pub(crate) struct CullPass(ComputePass);

impl FromWorld for CullPass {
    fn from_world(world: &mut World) -> Self {
        let read = storage_buffer_read_only_sized(false, None);
        let own = BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                read,
                read,
                uniform_buffer::<ClipPassUniform>(false),
                storage_buffer_read_only::<Vec<CarverUniform>>(false),
                texture_storage_3d(BRICK_FORMAT, StorageTextureAccess::WriteOnly),
            ),
        );
        let descriptor = PassDescriptor {
            name: "contextual_ao_cull",
            shader: load_embedded_asset!(world, "cull.wgsl"),
            before: vec![layouts::compute_layout()],
            own: &own,
            behind: vec![work_layout()],
            ..default()
        };
        Self(ComputePass::new(world, descriptor))
    }
}

impl CullPass {
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
            &volume.bricks.near_carvers.view,
        );
        Some(self.bind(resources, cache, device))
    }
}
