//! The bindings that every pass over a volume shares, and the material with it
//! (`volume_bindings.wgsl`).

use bevy::{
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntry, BindGroupLayoutDescriptor, BindGroupLayoutEntries,
            BindGroupLayoutEntry, OwnedBindingResource, PipelineCache, SamplerBindingType, ShaderStages,
            TextureSampleType, TextureViewDimension,
            binding_types::{sampler, texture_2d, texture_2d_array, texture_3d, uniform_buffer},
        },
        renderer::RenderDevice,
    },
};

use super::{
    clip_textures::ClipTextures,
    formats::Formats,
    volume_store::VolumeResources,
    volume_uniform::{CarverTable, VolumeUniform},
};

/// The layout of the shared bindings, 0 to 6.
pub(crate) fn layout_entries(stages: ShaderStages) -> Vec<BindGroupLayoutEntry> {
    let filtered = TextureSampleType::Float { filterable: true };
    let exact = TextureSampleType::Float { filterable: false };
    BindGroupLayoutEntries::sequential(
        stages,
        (
            uniform_buffer::<VolumeUniform>(false),
            uniform_buffer::<CarverTable>(false),
            texture_3d(filtered),
            texture_2d(exact),
            texture_2d_array(exact),
            texture_2d_array(exact),
            sampler(SamplerBindingType::Filtering),
        ),
    )
    .to_vec()
}

/// The layout as group 0 of a compute pass.
pub(crate) fn compute_layout() -> BindGroupLayoutDescriptor {
    BindGroupLayoutDescriptor::new("contextual_ao_volume", &layout_entries(ShaderStages::COMPUTE))
}

/// What is bound there. `None` before the buffers were first written.
pub(crate) fn bindings(
    volume: &VolumeResources,
    clip: &ClipTextures,
    formats: &Formats,
) -> Option<Vec<(u32, OwnedBindingResource)>> {
    use OwnedBindingResource::{Buffer, Sampler, TextureView};
    let resources = [
        Buffer(volume.uniform.buffer()?.clone()),
        Buffer(volume.carvers.buffer()?.clone()),
        TextureView(TextureViewDimension::D3, volume.intensities.clone()),
        TextureView(TextureViewDimension::D2, volume.lookup_table.view.clone()),
        TextureView(TextureViewDimension::D2Array, clip.depth.view.clone()),
        TextureView(TextureViewDimension::D2Array, clip.dilation.view.clone()),
        Sampler(SamplerBindingType::Filtering, formats.edge_sampler.clone()),
    ];
    Some((0..).zip(resources).collect())
}

/// Group 0 of the compute passes over one volume.
pub(crate) fn compute_bind_group(
    volume: &VolumeResources,
    clip: &ClipTextures,
    formats: &Formats,
    cache: &PipelineCache,
    device: &RenderDevice,
) -> Option<BindGroup> {
    let bindings = bindings(volume, clip, formats)?;
    let entries: Vec<_> = bindings
        .iter()
        .map(|(binding, resource)| BindGroupEntry { binding: *binding, resource: resource.get_binding() })
        .collect();
    Some(device.create_bind_group(
        "contextual_ao_volume",
        &cache.get_bind_group_layout(&compute_layout()),
        &entries,
    ))
}
