//! Distance of bricks from the nearest brick in which something may be visible, in superbricks near a change.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutEntries, BindGroupLayoutEntry, Buffer,
            CommandEncoder, PipelineCache, ShaderStages, StorageTextureAccess, TextureSampleType,
            binding_types::{
                storage_buffer_read_only_sized, storage_buffer_sized, texture_3d, texture_storage_3d,
            },
        },
        renderer::RenderDevice,
    },
    shader::ShaderDefVal,
};

use crate::render::{
    gpu::compute_pass::{ComputePass, Groups, ListEnd, PassDescriptor, are_ready},
    volumes::{bricks::BRICK_FORMAT, layouts, store::VolumeResources},
};

/// Passes over the superbricks at the back of the list.
#[derive(Resource)]
pub(crate) struct DistancePasses {
    find_seen: ComputePass,
    find_distances: ComputePass,
}

/// The bind groups of these passes.
#[derive(Clone)]
pub(crate) struct DistanceGroups {
    find_seen: BindGroup,
    find_distances: BindGroup,
}

impl FromWorld for DistancePasses {
    fn from_world(world: &mut World) -> Self {
        let read = storage_buffer_read_only_sized(false, None);
        let shader: Handle<Shader> = load_embedded_asset!(world, "distances.wgsl");
        let pass = |name, shader_defs: Vec<ShaderDefVal>, own: &[BindGroupLayoutEntry]| {
            let descriptor = PassDescriptor {
                name,
                shader: shader.clone(),
                shader_defs,
                before: vec![layouts::compute_layout()],
                own,
                zeroes_memory: true,
                ..default()
            };
            ComputePass::new(world, descriptor)
        };
        let stages = ShaderStages::COMPUTE;
        let written = storage_buffer_sized(false, None);
        let seen = BindGroupLayoutEntries::with_indices(
            stages,
            ((0, read), (1, read), (4, read), (5, read), (6, written)),
        );
        let distances = BindGroupLayoutEntries::with_indices(
            stages,
            (
                (1, read),
                (4, read),
                (5, read),
                (6, read),
                (7, texture_3d(TextureSampleType::Uint)),
                (8, texture_storage_3d(BRICK_FORMAT, StorageTextureAccess::WriteOnly)),
            ),
        );
        Self {
            find_seen: pass("contextual_ao_seen", vec!["FIND_SEEN".into()], &seen),
            find_distances: pass("contextual_ao_distances", vec![], &distances),
        }
    }
}

impl DistancePasses {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        are_ready([&self.find_seen, &self.find_distances], cache)
    }

    pub fn bind_volume(
        &self,
        volume: &VolumeResources,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> DistanceGroups {
        let bricks = &volume.bricks;
        let seen = BindGroupEntries::with_indices((
            (0, bricks.opaque_before.as_entire_binding()),
            (1, bricks.ranges.as_entire_binding()),
            (4, bricks.superbrick_list.as_entire_binding()),
            (5, bricks.voxel_masks.as_entire_binding()),
            (6, bricks.superbricks.as_entire_binding()),
        ));
        let distances = BindGroupEntries::with_indices((
            (1, bricks.ranges.as_entire_binding()),
            (4, bricks.superbrick_list.as_entire_binding()),
            (5, bricks.near_carvers.as_entire_binding()),
            (6, bricks.superbricks.as_entire_binding()),
            (7, &bricks.static_distances.view),
            (8, &bricks.words.view),
        ));
        DistanceGroups {
            find_seen: self.find_seen.bind_entries(&seen, cache, device),
            find_distances: self.find_distances.bind_entries(&distances, cache, device),
        }
    }

    /// Writes the words of the bricks in the listed superbricks.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        volume: &BindGroup,
        groups: &DistanceGroups,
        superbricks: &Buffer,
        cache: &PipelineCache,
    ) {
        let listed = Groups::Listed(superbricks, ListEnd::Back);
        self.find_seen.encode(encoder, [volume, &groups.find_seen], listed, cache);
        self.find_distances.encode(encoder, [volume, &groups.find_distances], listed, cache);
    }
}
