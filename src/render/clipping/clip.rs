//! Step IV: the clipping of voxels in the listed bricks, and their stale occlusion.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupLayoutEntries, Buffer, CommandEncoder, PipelineCache, ShaderStages,
            StorageTextureAccess,
            binding_types::{
                storage_buffer_read_only, storage_buffer_read_only_sized, texture_storage_3d, uniform_buffer,
            },
        },
        renderer::RenderDevice,
    },
};

use crate::render::{
    gpu::{
        compute_pass::{ComputePass, Groups, ListEnd, PassDescriptor, are_ready},
        formats::Formats,
    },
    volumes::{
        bricks::work_layout, carver_uniform::CarverUniform, clip_pass::ClipPassUniform, layouts,
        store::VolumeResources,
    },
};

/// Passes over the bricks of the two ends of a list.
#[derive(Resource)]
pub(crate) struct ClipPasses {
    clip: ComputePass,
    /// For bricks in which nothing is clipped.
    expire: ComputePass,
}

impl FromWorld for ClipPasses {
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
                texture_storage_3d(world.resource::<Formats>().scalar, StorageTextureAccess::WriteOnly),
                read,
            ),
        );
        let pass = |name, shader| {
            let descriptor = PassDescriptor {
                name,
                shader,
                shader_defs: vec!["BY_GRADIENT".into()],
                before: vec![layouts::bricks_layout()],
                own: &own,
                behind: vec![work_layout()],
                zeroes_memory: true,
                ..default()
            };
            ComputePass::new(world, descriptor)
        };
        Self {
            clip: pass("contextual_ao_clip", load_embedded_asset!(world, "clip.wgsl")),
            expire: pass("contextual_ao_expire", load_embedded_asset!(world, "expire.wgsl")),
        }
    }
}

impl ClipPasses {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        are_ready([&self.clip, &self.expire], cache)
    }

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
            volume.bricks.near_carvers.as_entire_binding(),
        );
        Some(self.clip.bind(resources, cache, device))
    }

    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        groups: [&BindGroup; 3],
        list: &Buffer,
        cache: &PipelineCache,
    ) {
        self.clip.encode(encoder, groups, Groups::Listed(list, ListEnd::Front), cache);
        self.expire.encode(encoder, groups, Groups::Listed(list, ListEnd::Back), cache);
    }
}
