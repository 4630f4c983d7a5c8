//! Layouts of the bindings that all passes over a volume share with drawing (`bindings.wgsl`).

use bevy::{
    prelude::*,
    render::render_resource::{
        BindGroupLayoutDescriptor, BindGroupLayoutEntries, BindGroupLayoutEntry, SamplerBindingType,
        ShaderStages, TextureSampleType,
        binding_types::{sampler, texture_2d, texture_2d_array, texture_3d, uniform_buffer},
    },
};

use super::{carver_uniform::CarverTable, uniform::VolumeUniform};

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

/// The layout with the words of bricks, 7 (`brick_bindings.wgsl`).
pub(crate) fn brick_layout_entries(stages: ShaderStages) -> Vec<BindGroupLayoutEntry> {
    let mut entries = layout_entries(stages);
    entries.push(texture_3d(TextureSampleType::Uint).build(7, stages));
    entries
}

/// The layout with the data of bricks as group 0 of a compute pass.
pub(crate) fn bricks_layout() -> BindGroupLayoutDescriptor {
    BindGroupLayoutDescriptor::new("contextual_ao_bricks", &brick_layout_entries(ShaderStages::COMPUTE))
}

/// The same layout with the opacities for lighting samples, 9 (`orientation.wgsl`).
pub(crate) fn lit_layout() -> BindGroupLayoutDescriptor {
    let mut entries = brick_layout_entries(ShaderStages::COMPUTE);
    let opacities = texture_3d(TextureSampleType::Float { filterable: true });
    entries.push(opacities.build(9, ShaderStages::COMPUTE));
    BindGroupLayoutDescriptor::new("contextual_ao_lit", &entries)
}
