//! Passes that find the nearest surface in each pixel of a view: of opaque meshes, then of one volume after the other.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroup, BindGroupLayoutEntries, BindGroupLayoutEntry, BindingResource, ShaderStages,
        StorageTextureAccess, TextureSampleType, TextureView,
        binding_types::{
            texture_2d, texture_depth_2d, texture_depth_2d_multisampled, texture_storage_2d, uniform_buffer,
        },
    },
};

use super::uniform::{SURFACE_FORMAT, ScreenSpaceUniform};
use crate::render::{
    gpu::{
        compute_pass::{ComputePass, PassDescriptor},
        device::Gpu,
    },
    volumes::{layouts::lit_layout, store::VolumeResources},
    windows::WindowUniform,
};

/// The passes that find surfaces.
pub(super) struct SurfacePasses {
    /// Passes without a depth prepass, with one, and with a multisampled one.
    opaque: [ComputePass; 3],
    /// For transfer functions of the intensity alone, and for others.
    volume: [ComputePass; 2],
}

impl FromWorld for SurfacePasses {
    fn from_world(world: &mut World) -> Self {
        let stages = ShaderStages::COMPUTE;
        let written = texture_storage_2d(SURFACE_FORMAT, StorageTextureAccess::WriteOnly);
        let view = uniform_buffer::<ScreenSpaceUniform>(false);
        let opaque = |own: &[BindGroupLayoutEntry], defs: &[&'static str]| {
            let descriptor = PassDescriptor {
                name: "contextual_ao_opaque_surface",
                shader: load_embedded_asset!(world, "opaque_surface.wgsl"),
                shader_defs: defs.iter().map(|&def| def.into()).collect(),
                own,
                ..default()
            };
            ComputePass::new(world, descriptor)
        };
        let opaque = [
            opaque(&BindGroupLayoutEntries::sequential(stages, (view, written)), &[]),
            opaque(
                &BindGroupLayoutEntries::sequential(stages, (view, written, texture_depth_2d())),
                &["DEPTH"],
            ),
            opaque(
                &BindGroupLayoutEntries::sequential(stages, (view, written, texture_depth_2d_multisampled())),
                &["DEPTH", "DEPTH_MULTISAMPLED"],
            ),
        ];
        let own = BindGroupLayoutEntries::sequential(
            stages,
            (
                uniform_buffer::<WindowUniform>(false),
                uniform_buffer::<f32>(false),
                texture_2d(TextureSampleType::Uint),
                written,
            ),
        );
        let volume = |by_gradient: bool| {
            let descriptor = PassDescriptor {
                name: "contextual_ao_volume_surface",
                shader: load_embedded_asset!(world, "volume_surface.wgsl"),
                shader_defs: by_gradient.then(|| "BY_GRADIENT".into()).into_iter().collect(),
                before: vec![lit_layout()],
                own: &own,
                ..default()
            };
            ComputePass::new(world, descriptor)
        };
        Self { opaque, volume: [false, true].map(volume) }
    }
}

impl SurfacePasses {
    pub fn all(&self) -> impl Iterator<Item = &ComputePass> {
        self.opaque.iter().chain(&self.volume)
    }

    /// The pass over opaque meshes, for a view's depth prepass with this number of samples; 0 without a prepass.
    pub fn opaque(&self, samples: u32) -> &ComputePass {
        &self.opaque[samples.min(2) as usize]
    }

    /// The pass over a volume whose transfer function follows the gradient, or not.
    pub fn volume(&self, by_gradient: bool) -> &ComputePass {
        &self.volume[usize::from(by_gradient)]
    }

    /// Binds a volume and a window of a view onto it. The pass reads the surfaces `before` and writes `written`.
    pub fn bind_volume(
        &self,
        volume: &VolumeResources,
        [window, opacity_threshold]: [BindingResource; 2],
        [before, written]: [&TextureView; 2],
        gpu: &Gpu,
    ) -> Option<[BindGroup; 2]> {
        let own = (window, opacity_threshold, before, written);
        Some([volume.groups()?.lit.clone(), self.volume(false).bind(own, &gpu.cache, &gpu.device)])
    }
}
