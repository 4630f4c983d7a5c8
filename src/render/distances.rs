//! How far every brick is from the nearest in which something may be seen.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupLayoutEntries, Buffer, CommandEncoder, PipelineCache, ShaderStages,
            binding_types::{storage_buffer_read_only_sized, storage_buffer_sized},
        },
        renderer::RenderDevice,
    },
    shader::ShaderDefVal,
};

use super::{
    compute_pass::{ComputePass, Groups, PassDescriptor},
    volume_bindings,
    volume_store::VolumeResources,
};

/// What is occupied, then a sweep along each axis; each visits all bricks.
#[derive(Resource)]
pub(crate) struct DistancePasses([ComputePass; 4]);

impl FromWorld for DistancePasses {
    fn from_world(world: &mut World) -> Self {
        let read = storage_buffer_read_only_sized(false, None);
        let own = BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (read, read, storage_buffer_sized(false, None), read),
        );
        let shader: Handle<Shader> = load_embedded_asset!(world, "distances.wgsl");
        let axis = |axis| ShaderDefVal::UInt("AXIS".into(), axis);
        Self(["OCCUPY".into(), axis(0), axis(1), axis(2)].map(|step| {
            let descriptor = PassDescriptor {
                name: "contextual_ao_distances",
                shader: shader.clone(),
                shader_defs: vec![step],
                before: vec![volume_bindings::compute_layout()],
                own: &own,
                ..default()
            };
            ComputePass::new(world, descriptor)
        }))
    }
}

impl DistancePasses {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        self.0.iter().all(|step| step.is_ready(cache))
    }

    /// One group for each step.
    pub fn bind_volume(
        &self,
        volume: &VolumeResources,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> [BindGroup; 4] {
        let bricks = &volume.bricks;
        let bind = |step: usize, written: &Buffer, read: &Buffer| {
            let resources = (
                bricks.opaque_before.as_entire_binding(),
                bricks.ranges.as_entire_binding(),
                written.as_entire_binding(),
                read.as_entire_binding(),
            );
            self.0[step].bind(resources, cache, device)
        };
        let (to, fro) = (&bricks.distances, &bricks.other_distances);
        [bind(0, fro, &bricks.voxel_masks), bind(1, to, fro), bind(2, fro, to), bind(3, to, fro)]
    }

    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        volume: &BindGroup,
        steps: &[BindGroup; 4],
        bricks: u32,
        cache: &PipelineCache,
    ) {
        for (pass, step) in self.0.iter().zip(steps) {
            pass.encode(encoder, [volume, step], Groups::Bricks(bricks), cache);
        }
    }
}
