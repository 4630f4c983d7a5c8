//! Passes that sum the opacities of a volume along each axis (`table.wgsl`).

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroup, BindGroupLayoutEntries, Buffer, CommandEncoder, PipelineCache, ShaderStages,
        TextureSampleType,
        binding_types::{storage_buffer_sized, texture_3d},
    },
    shader::ShaderDefVal,
};

use crate::render::{
    gpu::{
        compute_pass::{ComputePass, Groups, PassDescriptor, are_ready},
        device::Gpu,
    },
    methods::voxel_method::{VolumeFrame, volume_layout},
};

/// The passes along x, y and z, in this order.
pub(super) struct TablePasses([ComputePass; 3]);

impl FromWorld for TablePasses {
    fn from_world(world: &mut World) -> Self {
        let own = BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (texture_3d(TextureSampleType::Float { filterable: true }), storage_buffer_sized(false, None)),
        );
        let shader: Handle<Shader> = load_embedded_asset!(world, "table.wgsl");
        let pass = |axis| {
            let descriptor = PassDescriptor {
                name: "contextual_ao_summed_area_table",
                shader: shader.clone(),
                shader_defs: vec![ShaderDefVal::UInt("AXIS".into(), axis)],
                before: vec![volume_layout()],
                own: &own,
                ..default()
            };
            ComputePass::new(world, descriptor)
        };
        Self([0, 1, 2].map(pass))
    }
}

impl TablePasses {
    pub fn are_ready(&self, cache: &PipelineCache) -> bool {
        are_ready(&self.0, cache)
    }

    /// Binds the opacities and the table. The passes along all axes share the group.
    pub fn bind_volume(&self, volume: &VolumeFrame, table: &Buffer, gpu: &Gpu) -> BindGroup {
        let [along_x, ..] = &self.0;
        along_x.bind((volume.opacities(), table.as_entire_binding()), &gpu.cache, &gpu.device)
    }

    /// Encodes the passes. An invocation follows a line along the axis.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        groups: [&BindGroup; 2],
        dimensions: UVec3,
        cache: &PipelineCache,
    ) {
        for (pass, length) in self.0.iter().zip(dimensions.to_array()) {
            let lines = Groups::Invocations(dimensions.element_product() / length);
            pass.encode(encoder, groups, lines, cache);
        }
    }
}
