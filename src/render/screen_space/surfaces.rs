//! What each pixel of a view shows: opaque meshes, then one volume after the other, whatever is nearest.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntry, BindGroupLayoutDescriptor, BindGroupLayoutEntries,
            BindGroupLayoutEntry, OwnedBindingResource, PipelineCache, ShaderStages, StorageTextureAccess,
            TextureFormat, TextureSampleType, TextureView, TextureViewDimension, UniformBuffer,
            binding_types::{
                texture_2d, texture_3d, texture_depth_2d, texture_depth_2d_multisampled, texture_storage_2d,
                uniform_buffer,
            },
        },
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::views::ScreenSpaceUniform;
use crate::render::{
    clip_textures::ClipTextures,
    compute_pass::{ComputePass, PassDescriptor},
    formats::Formats,
    pass_uniforms::WindowUniform,
    volume_bindings,
    volume_store::VolumeResources,
};

/// Of textures of surfaces: depth and normal.
pub(super) const SURFACE_FORMAT: TextureFormat = TextureFormat::Rg32Uint;
/// Binding of the opacities, behind all others of a volume (`opacity_gradient.wgsl`).
const OPACITIES: u32 = 9;

/// The passes that find surfaces.
pub(super) struct SurfacePasses {
    /// Without a depth prepass, with one, with a multisampled one.
    opaque: [ComputePass; 3],
    pub volume: ComputePass,
    volume_layout: BindGroupLayoutDescriptor,
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
        let mut entries = volume_bindings::brick_layout_entries(stages);
        entries.push(texture_3d(TextureSampleType::Float { filterable: true }).build(OPACITIES, stages));
        let volume_layout = BindGroupLayoutDescriptor::new("contextual_ao_surface_volume", &entries);
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
            before: vec![volume_layout.clone()],
            own: &own,
            ..default()
        };
        Self { opaque, volume: ComputePass::new(world, descriptor), volume_layout }
    }
}

impl SurfacePasses {
    pub fn are_ready(&self, cache: &PipelineCache) -> bool {
        self.opaque.iter().chain([&self.volume]).all(|pass| pass.is_ready(cache))
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
        let mut bindings = volume_bindings::brick_bindings(volume, clip, formats)?;
        let opacities = volume.opacities.view.clone();
        bindings.push((OPACITIES, OwnedBindingResource::TextureView(TextureViewDimension::D3, opacities)));
        let entries: Vec<_> = bindings
            .iter()
            .map(|(binding, resource)| BindGroupEntry { binding: *binding, resource: resource.get_binding() })
            .collect();
        let layout = cache.get_bind_group_layout(&self.volume_layout);
        let volume_group = device.create_bind_group("contextual_ao_surface_volume", &layout, &entries);
        let mut window = UniformBuffer::from(window);
        window.write_buffer(device, queue);
        let mut threshold = UniformBuffer::from(opacity_threshold);
        threshold.write_buffer(device, queue);
        let own = (window.binding()?, threshold.binding()?, before, written);
        Some([volume_group, self.volume.bind(own, cache, device)])
    }
}
