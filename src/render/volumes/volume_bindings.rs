//! The bindings that every pass over a volume shares, and the material with it
//! (`volume_bindings.wgsl`).

use bevy::{
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntry, BindGroupLayoutDescriptor, BindGroupLayoutEntries,
            BindGroupLayoutEntry, BindingResource, OwnedBindingResource, PipelineCache, SamplerBindingType,
            ShaderStages, TextureSampleType, TextureViewDimension,
            binding_types::{sampler, texture_2d, texture_2d_array, texture_3d, uniform_buffer},
        },
        renderer::RenderDevice,
    },
};

use super::{carver_uniform::CarverTable, volume_store::VolumeResources, volume_uniform::VolumeUniform};
use crate::render::{carvers::clip_textures::ClipTextures, gpu::formats::Formats};

/// Binding of the dilation maps.
pub(crate) const DILATION_MAPS: u32 = 5;

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

/// The layout with what is known of bricks, 7 and 8 (`brick_bindings.wgsl`).
pub(crate) fn brick_layout_entries(stages: ShaderStages) -> Vec<BindGroupLayoutEntry> {
    let mut entries = layout_entries(stages);
    entries.extend([7, 8].map(|binding| texture_3d(TextureSampleType::Uint).build(binding, stages)));
    entries
}

/// That layout as group 0 of a compute pass.
pub(crate) fn bricks_layout() -> BindGroupLayoutDescriptor {
    BindGroupLayoutDescriptor::new("contextual_ao_bricks", &brick_layout_entries(ShaderStages::COMPUTE))
}

/// The same with what samples are lit by, 9 (`orientation.wgsl`).
pub(crate) fn lit_layout() -> BindGroupLayoutDescriptor {
    let mut entries = brick_layout_entries(ShaderStages::COMPUTE);
    let opacities = texture_3d(TextureSampleType::Float { filterable: true });
    entries.push(opacities.build(9, ShaderStages::COMPUTE));
    BindGroupLayoutDescriptor::new("contextual_ao_lit", &entries)
}

/// What is bound to what is known of bricks, all of it. `None` before the buffers were first written.
pub(crate) fn brick_bindings(
    volume: &VolumeResources,
    clip: &ClipTextures,
    formats: &Formats,
) -> Option<Vec<(u32, OwnedBindingResource)>> {
    use OwnedBindingResource::{Buffer, Sampler, TextureView};
    let resources = [
        Buffer(volume.uniform.buffer()?.clone()),
        Buffer(volume.carvers.buffer()?.clone()),
        TextureView(TextureViewDimension::D3, volume.gpu_volume.view.clone()),
        TextureView(TextureViewDimension::D2, volume.lookup_table.view.clone()),
        TextureView(TextureViewDimension::D2Array, clip.depth.view.clone()),
        TextureView(TextureViewDimension::D2Array, clip.dilation.view.clone()),
        Sampler(SamplerBindingType::Filtering, formats.edge_sampler.clone()),
        TextureView(TextureViewDimension::D3, volume.bricks.near_carvers.view.clone()),
        TextureView(TextureViewDimension::D3, volume.bricks.distances.view.clone()),
    ];
    Some((0..).zip(resources).collect())
}

/// Group 0 of the compute passes over one volume: without what is known of bricks, and with it.
pub(crate) fn compute_bind_groups(
    volume: &VolumeResources,
    clip: &ClipTextures,
    formats: &Formats,
    cache: &PipelineCache,
    device: &RenderDevice,
) -> Option<[BindGroup; 2]> {
    let bindings = brick_bindings(volume, clip, formats)?;
    let entries: Vec<_> = bindings
        .iter()
        .map(|(binding, resource)| BindGroupEntry { binding: *binding, resource: resource.get_binding() })
        .collect();
    let group = |layout: BindGroupLayoutDescriptor, entries: &[BindGroupEntry]| {
        device.create_bind_group("contextual_ao_volume", &cache.get_bind_group_layout(&layout), entries)
    };
    Some([group(compute_layout(), &entries[..7]), group(bricks_layout(), &entries)])
}

/// The group of [`lit_layout`].
pub(crate) fn lit_bind_group(
    volume: &VolumeResources,
    clip: &ClipTextures,
    formats: &Formats,
    cache: &PipelineCache,
    device: &RenderDevice,
) -> Option<BindGroup> {
    let bindings = brick_bindings(volume, clip, formats)?;
    let bricks = bindings.iter().map(|(binding, resource)| (*binding, resource.get_binding()));
    let opacities = (9, BindingResource::TextureView(&volume.opacities.view));
    let entries = bricks.chain([opacities]).map(|(binding, resource)| BindGroupEntry { binding, resource });
    let entries: Vec<_> = entries.collect();
    let layout = cache.get_bind_group_layout(&lit_layout());
    Some(device.create_bind_group("contextual_ao_lit", &layout, &entries))
}
