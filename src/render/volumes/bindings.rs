//! Bindings of a volume for every pass over it, and for drawing (`bindings.wgsl`).

use bevy::{
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntry, BindGroupLayoutDescriptor, BindingResource, OwnedBindingResource,
            PipelineCache, SamplerBindingType, TextureViewDimension,
        },
        renderer::RenderDevice,
    },
};

use super::{
    layouts::{bricks_layout, compute_layout, lit_layout},
    store::{VolumeGroups, VolumeResources},
};
use crate::render::{carvers::clip_textures::ClipTextures, gpu::formats::Formats};

impl VolumeResources {
    /// All shared bindings, those of brick data included. `None` before the buffers were first written.
    pub fn bindings(
        &self,
        clip: &ClipTextures,
        formats: &Formats,
    ) -> Option<Vec<(u32, OwnedBindingResource)>> {
        use OwnedBindingResource::{Buffer, Sampler, TextureView};
        let resources = [
            Buffer(self.uniform.buffer()?.clone()),
            Buffer(self.carvers.buffer()?.clone()),
            TextureView(TextureViewDimension::D3, self.gpu_volume.view.clone()),
            TextureView(TextureViewDimension::D2, self.lookup_table.texture.view.clone()),
            TextureView(TextureViewDimension::D2Array, clip.depth.view.clone()),
            TextureView(TextureViewDimension::D2Array, clip.dilation.view.clone()),
            Sampler(SamplerBindingType::Filtering, formats.edge_sampler.clone()),
            TextureView(TextureViewDimension::D3, self.bricks.words.view.clone()),
        ];
        Some((0..).zip(resources).collect())
    }

    /// Makes group 0 of compute passes, if it is missing or binds textures that are gone. The other resources that it
    /// binds live as long as the volume.
    pub fn keep_groups(
        &mut self,
        clip: &ClipTextures,
        formats: &Formats,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> Option<VolumeGroups> {
        let bound =
            [&clip.depth.view, &clip.dilation.view, &self.lookup_table.texture.view].map(|view| view.id());
        if self.groups.as_ref().is_none_or(|groups| groups.bound != bound) {
            self.groups = None;
            let bindings = self.bindings(clip, formats)?;
            let opacities = (9, BindingResource::TextureView(&self.opacities.view));
            let shared = bindings.iter().map(|(binding, resource)| (*binding, resource.get_binding()));
            let entries =
                shared.chain([opacities]).map(|(binding, resource)| BindGroupEntry { binding, resource });
            let entries: Vec<_> = entries.collect();
            let group = |layout: BindGroupLayoutDescriptor, entries: &[BindGroupEntry]| -> BindGroup {
                device.create_bind_group(
                    "contextual_ao_volume",
                    &cache.get_bind_group_layout(&layout),
                    entries,
                )
            };
            self.groups = Some(VolumeGroups {
                bound,
                volume: group(compute_layout(), &entries[..7]),
                bricks: group(bricks_layout(), &entries[..8]),
                lit: group(lit_layout(), &entries),
            });
        }
        self.groups.clone()
    }

    /// Group 0, as made in the last frame in which the volume was seen and ready.
    pub fn groups(&self) -> Option<&VolumeGroups> {
        self.groups.as_ref()
    }
}
