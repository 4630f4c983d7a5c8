//! What each pixel of a view shows: opaque meshes, then one volume after the other, whatever is nearest.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupLayoutEntries, BindGroupLayoutEntry, PipelineCache, ShaderStages,
            StorageTextureAccess, TextureFormat, TextureSampleType, TextureView, UniformBuffer,
            binding_types::{
                texture_2d, texture_depth_2d, texture_depth_2d_multisampled, texture_storage_2d,
                uniform_buffer,
            },
        },
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::views::ScreenSpaceUniform;
use crate::render::{
    carvers::clip_textures::ClipTextures,
    gpu::{
        compute_pass::{ComputePass, PassDescriptor},
        formats::Formats,
    },
    volumes::{pass_uniforms::WindowUniform, volume_bindings, volume_store::VolumeResources},
};

/// Of textures of surfaces: depth and normal.
pub(super) const SURFACE_FORMAT: TextureFormat = TextureFormat::Rg32Uint;

/// The passes that find surfaces.
pub(super) struct SurfacePasses {
    /// Without a depth prepass, with one, with a multisampled one.
    opaque: [ComputePass; 3],
    pub volume: ComputePass,
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
        let descriptor = PassDescriptor {
            name: "contextual_ao_volume_surface",
            shader: load_embedded_asset!(world, "volume_surface.wgsl"),
            before: vec![volume_bindings::lit_layout()],
            own: &own,
            ..default()
        };
        Self { opaque, volume: ComputePass::new(world, descriptor) }
    }
}

impl SurfacePasses {
    pub fn all(&self) -> impl Iterator<Item = &ComputePass> {
        self.opaque.iter().chain([&self.volume])
    }

    /// The pass over opaque meshes, by a view's depth prepass with so many samples; 0 where it has none.
    pub fn opaque(&self, samples: u32) -> &ComputePass {
        &self.opaque[samples.min(2) as usize]
    }

    /// Binds a volume, and a view of it: the surfaces before, and those that are written.
    pub fn bind_volume(
        &self,
        volume: &VolumeResources,
        clip: &ClipTextures,
        (window, opacity_threshold): (WindowUniform, f32),
        [before, written]: [&TextureView; 2],
        (formats, cache, device, queue): (&Formats, &PipelineCache, &RenderDevice, &RenderQueue),
    ) -> Option<[BindGroup; 2]> {
        let volume_group = volume_bindings::lit_bind_group(volume, clip, formats, cache, device)?;
        let mut window = UniformBuffer::from(window);
        window.write_buffer(device, queue);
        let mut threshold = UniformBuffer::from(opacity_threshold);
        threshold.write_buffer(device, queue);
        let own = (window.binding()?, threshold.binding()?, before, written);
        Some([volume_group, self.volume.bind(own, cache, device)])
    }
}
