//! Step IV: what carvers leave of the voxels in the listed bricks.

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

use super::{
    brick_buffers::work_layout,
    carver_uniform::CarverUniform,
    compute_pass::{ComputePass, PassDescriptor},
    formats::Formats,
    pass_uniforms::OcclusionPassUniform,
    volume_bindings,
    volume_store::VolumeResources,
};

/// Visits the bricks of a list.
#[derive(Resource, Deref)]
pub(crate) struct ClipPass(ComputePass);

impl FromWorld for ClipPass {
    fn from_world(world: &mut World) -> Self {
        let read = storage_buffer_read_only_sized(false, None);
        let own = BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                read,
                read,
                uniform_buffer::<OcclusionPassUniform>(false),
                storage_buffer_read_only::<Vec<CarverUniform>>(false),
                read,
                texture_storage_3d(world.resource::<Formats>().scalar, StorageTextureAccess::WriteOnly),
            ),
        );
        let descriptor = PassDescriptor {
            name: "contextual_ao_clip",
            shader: load_embedded_asset!(world, "clip.wgsl"),
            before: vec![volume_bindings::bricks_layout()],
            own: &own,
            behind: vec![work_layout()],
            zeroes_memory: true,
            ..default()
        };
        Self(ComputePass::new(world, descriptor))
    }
}

impl ClipPass {
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
            volume.bricks.brick_list.as_entire_binding(),
            &volume.opacities.view,
        );
        Some(self.bind(resources, cache, device))
    }
}
