//! How far every brick is from the nearest in which something may be seen.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, Buffer,
            CachedComputePipelineId, CommandEncoder, ComputePipelineDescriptor, PipelineCache, ShaderStages,
            binding_types::{storage_buffer_read_only_sized, storage_buffer_sized, uniform_buffer},
        },
        renderer::RenderDevice,
    },
    shader::ShaderDefVal,
};

use super::{
    dispatch::{Groups, dispatch},
    formats::Formats,
    volume_bindings,
    volume_store::VolumeResources,
    volume_uniform::OcclusionPassUniform,
};

#[derive(Resource)]
pub(crate) struct DistancePipelines {
    layout: BindGroupLayoutDescriptor,
    /// What is occupied, then a sweep along each axis.
    steps: [CachedComputePipelineId; 4],
}

impl FromWorld for DistancePipelines {
    fn from_world(world: &mut World) -> Self {
        let read = storage_buffer_read_only_sized(false, None);
        let layout = BindGroupLayoutDescriptor::new(
            "contextual_ao_distances",
            &BindGroupLayoutEntries::sequential(
                ShaderStages::COMPUTE,
                (
                    uniform_buffer::<OcclusionPassUniform>(false),
                    read,
                    read,
                    storage_buffer_sized(false, None),
                    read,
                ),
            ),
        );
        let shader: Handle<Shader> = load_embedded_asset!(world, "distances.wgsl");
        let formats = world.resource::<Formats>();
        let cache = world.resource::<PipelineCache>();
        let axis = |axis| ShaderDefVal::UInt("AXIS".into(), axis);
        let steps = ["OCCUPY".into(), axis(0), axis(1), axis(2)].map(|step| {
            let mut shader_defs = formats.shader_defs();
            shader_defs.push(step);
            cache.queue_compute_pipeline(ComputePipelineDescriptor {
                label: Some("contextual_ao_distances".into()),
                layout: vec![volume_bindings::compute_layout(), layout.clone()],
                shader: shader.clone(),
                shader_defs,
                ..default()
            })
        });
        Self { layout, steps }
    }
}

impl DistancePipelines {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        self.steps.iter().all(|step| cache.get_compute_pipeline(*step).is_some())
    }

    /// One group for each step.
    pub fn bind(
        &self,
        volume: &VolumeResources,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> Option<[BindGroup; 4]> {
        let bricks = &volume.bricks;
        let pass = volume.pass.binding()?;
        let bind = |written: &Buffer, read: &Buffer| {
            device.create_bind_group(
                "contextual_ao_distances",
                &cache.get_bind_group_layout(&self.layout),
                &BindGroupEntries::sequential((
                    pass.clone(),
                    bricks.opaque_before.as_entire_binding(),
                    bricks.ranges.as_entire_binding(),
                    written.as_entire_binding(),
                    read.as_entire_binding(),
                )),
            )
        };
        let (to, fro) = (&bricks.distances, &bricks.other_distances);
        Some([bind(fro, &bricks.voxel_masks), bind(to, fro), bind(fro, to), bind(to, fro)])
    }

    /// Visits all bricks.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        volume: &BindGroup,
        steps: &[BindGroup; 4],
        bricks: u32,
        cache: &PipelineCache,
    ) {
        for (pipeline, step) in self.steps.iter().zip(steps) {
            if let Some(pipeline) = cache.get_compute_pipeline(*pipeline) {
                let groups = [volume, step];
                dispatch(encoder, "contextual_ao_distances", pipeline, groups, Groups::Bricks(bricks));
            }
        }
    }
}
