//! Pass that finds the occlusion factor of each pixel's surface.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroupLayoutEntries, ShaderStages, StorageTextureAccess, TextureSampleType,
        binding_types::{texture_2d, texture_storage_2d, uniform_buffer},
    },
};

use super::uniform::{KernelUniform, ScreenSpaceUniform};
use crate::render::gpu::{
    compute_pass::{ComputePass, PassDescriptor},
    formats::Formats,
};

/// Turns surfaces into occlusion factors.
#[derive(Deref)]
pub(super) struct OcclusionPass(ComputePass);

impl FromWorld for OcclusionPass {
    fn from_world(world: &mut World) -> Self {
        let own = BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                uniform_buffer::<ScreenSpaceUniform>(false),
                uniform_buffer::<KernelUniform>(false),
                texture_2d(TextureSampleType::Uint),
                texture_storage_2d(world.resource::<Formats>().scalar, StorageTextureAccess::WriteOnly),
            ),
        );
        let descriptor = PassDescriptor {
            name: "contextual_ao_screen_space",
            shader: load_embedded_asset!(world, "occlusion.wgsl"),
            own: &own,
            ..default()
        };
        Self(ComputePass::new(world, descriptor))
    }
}
