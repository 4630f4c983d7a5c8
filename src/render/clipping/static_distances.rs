//! Distance of every brick from the nearest brick that the transfer function does not make transparent.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupLayoutEntries, BindGroupLayoutEntry, CommandEncoder, PipelineCache,
            ShaderStages, StorageTextureAccess, TextureSampleType,
            binding_types::{storage_buffer_read_only_sized, texture_3d, texture_storage_3d},
        },
        renderer::RenderDevice,
    },
    shader::ShaderDefVal,
};

use crate::render::{
    gpu::compute_pass::{ComputePass, Groups, PassDescriptor, are_ready},
    volumes::{bricks::BRICK_FORMAT, layouts, store::VolumeResources},
};

/// A pass that finds these bricks, then a sweep along each axis. Each visits all bricks.
#[derive(Resource)]
pub(crate) struct StaticDistancePasses {
    occupy: ComputePass,
    sweeps: [ComputePass; 3],
}

/// The bind groups of these passes.
#[derive(Clone)]
pub(crate) struct StaticDistanceGroups {
    occupy: BindGroup,
    sweeps: [BindGroup; 3],
}

impl FromWorld for StaticDistancePasses {
    fn from_world(world: &mut World) -> Self {
        let read = storage_buffer_read_only_sized(false, None);
        let written = texture_storage_3d(BRICK_FORMAT, StorageTextureAccess::WriteOnly);
        let along_other_axes = texture_3d(TextureSampleType::Uint);
        let shader: Handle<Shader> = load_embedded_asset!(world, "static_distances.wgsl");
        let pass = |shader_def, own: &[BindGroupLayoutEntry]| {
            let descriptor = PassDescriptor {
                name: "contextual_ao_static_distances",
                shader: shader.clone(),
                shader_defs: vec![shader_def],
                before: vec![layouts::compute_layout()],
                own,
                ..default()
            };
            ComputePass::new(world, descriptor)
        };
        let stages = ShaderStages::COMPUTE;
        let occupy = BindGroupLayoutEntries::sequential(stages, (read, read, written));
        let sweep = BindGroupLayoutEntries::sequential(stages, (along_other_axes, written));
        Self {
            occupy: pass("OCCUPY".into(), &occupy),
            sweeps: [0, 1, 2].map(|axis| pass(ShaderDefVal::UInt("AXIS".into(), axis), &sweep)),
        }
    }
}

impl StaticDistancePasses {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        are_ready(self.sweeps.iter().chain([&self.occupy]), cache)
    }

    pub fn bind_volume(
        &self,
        volume: &VolumeResources,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> StaticDistanceGroups {
        let bricks = &volume.bricks;
        // The words of bricks are written anew afterwards: their texture holds distances meanwhile.
        let (to, fro) = (&bricks.static_distances.view, &bricks.words.view);
        let resources = (bricks.opaque_before.as_entire_binding(), bricks.ranges.as_entire_binding(), fro);
        let [x, y, z] = &self.sweeps;
        StaticDistanceGroups {
            occupy: self.occupy.bind(resources, cache, device),
            sweeps: [
                x.bind((fro, to), cache, device),
                y.bind((to, fro), cache, device),
                z.bind((fro, to), cache, device),
            ],
        }
    }

    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        volume: &BindGroup,
        groups: &StaticDistanceGroups,
        bricks: u32,
        cache: &PipelineCache,
    ) {
        self.occupy.encode(encoder, [volume, &groups.occupy], Groups::Invocations(bricks), cache);
        for (sweep, group) in self.sweeps.iter().zip(&groups.sweeps) {
            sweep.encode(encoder, [volume, group], Groups::Invocations(bricks), cache);
        }
    }
}
