//! The pass that finds every voxel's occlusion from the table (`boxes.wgsl`).

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroup, BindGroupLayoutEntries, ShaderStages, StorageTextureAccess,
        binding_types::{storage_buffer_read_only, storage_buffer_read_only_sized, texture_storage_3d},
    },
};

use super::resources::{Shell, SummedAreaResources};
use crate::render::{
    gpu::{
        compute_pass::{ComputePass, PassDescriptor},
        device::Gpu,
    },
    methods::voxel_method::{VolumeFrame, factor_format, volume_layout},
};

/// The pass.
#[derive(Deref)]
pub(super) struct BoxesPass(ComputePass);

impl FromWorld for BoxesPass {
    fn from_world(world: &mut World) -> Self {
        let own = BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                storage_buffer_read_only_sized(false, None),
                storage_buffer_read_only::<Vec<Shell>>(false),
                texture_storage_3d(factor_format(world), StorageTextureAccess::WriteOnly),
            ),
        );
        let descriptor = PassDescriptor {
            name: "contextual_ao_summed_area_boxes",
            shader: load_embedded_asset!(world, "boxes.wgsl"),
            before: vec![volume_layout()],
            own: &own,
            ..default()
        };
        Self(ComputePass::new(world, descriptor))
    }
}

impl BoxesPass {
    /// Writes the shells, and binds them with the table and the results.
    pub fn bind_volume(
        &self,
        volume: &VolumeFrame,
        kept: &mut SummedAreaResources,
        gpu: &Gpu,
    ) -> Option<BindGroup> {
        kept.write_shells(volume.settings()?, volume.geometry(), gpu);
        let own = (kept.table.as_entire_binding(), kept.shells.binding()?, volume.occlusion());
        Some(self.0.bind(own, &gpu.cache, &gpu.device))
    }
}
