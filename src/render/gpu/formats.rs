//! Texture formats and samplers that differ between adapters.

use bevy::shader::ShaderDefVal;
use bevy::{
    image::ImageSamplerBorderColor,
    prelude::*,
    render::{
        render_resource::{
            AddressMode, Extent3d, FilterMode, Sampler, SamplerDescriptor, TextureDescriptor,
            TextureDimension, TextureFormat, TextureUsages, WgpuFeatures,
        },
        renderer::{RenderAdapter, RenderDevice},
    },
};
use std::borrow::Cow;

use crate::volume::{Intensities, StoredBytes};

/// The formats and samplers chosen for this device.
#[derive(Resource)]
pub(crate) struct Formats {
    /// Format of one number in [0, 1] per voxel, written by compute passes and filtered when read.
    pub scalar: TextureFormat,
    /// Format of intensities of more than 8 bits.
    intensity16: TextureFormat,
    /// Filtering sampler that clamps to the edge.
    pub edge_sampler: Sampler,
    /// Filtering sampler that is transparent outside the grid if the device can, else clamps to the edge.
    pub grid_sampler: Sampler,
    has_grid_border: bool,
}

impl FromWorld for Formats {
    fn from_world(world: &mut World) -> Self {
        Self::new(world.resource(), world.resource())
    }
}

impl Formats {
    /// Chooses the best formats and samplers of a device.
    pub fn new(device: &RenderDevice, adapter: &RenderAdapter) -> Self {
        let features = device.features();
        let stores = |format: TextureFormat| {
            features.contains(WgpuFeatures::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES)
                && adapter
                    .get_texture_format_features(format)
                    .allowed_usages
                    .contains(TextureUsages::STORAGE_BINDING)
        };
        let has_grid_border = features.contains(WgpuFeatures::ADDRESS_MODE_CLAMP_TO_BORDER);
        let sampler = |label, border: bool| {
            let mode = if border { AddressMode::ClampToBorder } else { AddressMode::ClampToEdge };
            device.create_sampler(&SamplerDescriptor {
                label: Some(label),
                address_mode_u: mode,
                address_mode_v: mode,
                address_mode_w: mode,
                mag_filter: FilterMode::Linear,
                min_filter: FilterMode::Linear,
                border_color: border.then_some(ImageSamplerBorderColor::TransparentBlack.into()),
                ..default()
            })
        };
        Self {
            scalar: if stores(TextureFormat::R8Unorm) {
                TextureFormat::R8Unorm
            } else {
                TextureFormat::Rgba8Unorm
            },
            intensity16: if features.contains(WgpuFeatures::TEXTURE_FORMAT_16BIT_NORM) {
                TextureFormat::R16Unorm
            } else if features.contains(WgpuFeatures::FLOAT32_FILTERABLE) {
                TextureFormat::R32Float
            } else {
                // Keeps 11 bits, the most that core WebGPU filters.
                TextureFormat::R16Float
            },
            edge_sampler: sampler("contextual_ao_edge", false),
            grid_sampler: sampler("contextual_ao_grid", has_grid_border),
            has_grid_border,
        }
    }

    /// Number of bytes a voxel takes in each format.
    pub fn stored_bytes(&self) -> StoredBytes {
        let bytes = |format: TextureFormat| format.block_copy_size(None).unwrap_or(4).into();
        StoredBytes { scalar: bytes(self.scalar), intensity16: bytes(self.intensity16) }
    }

    /// Definitions for every compute shader.
    pub fn shader_defs(&self) -> Vec<ShaderDefVal> {
        let group = |name: &str, group| ShaderDefVal::UInt(name.into(), group);
        let mut defs = vec![group("VOLUME_BIND_GROUP", 0), group("RUNS_BIND_GROUP", 1)];
        if self.scalar == TextureFormat::R8Unorm {
            defs.push("STORE_R8".into());
        }
        if self.has_grid_border {
            defs.push("GRID_BORDER".into());
        }
        defs
    }

    /// Texture format of intensities, their values in this format, and the stored value that the texture gives as 1.
    pub fn encode_intensities<'a>(
        &self,
        intensities: &'a Intensities,
    ) -> (TextureFormat, Cow<'a, [u8]>, f64) {
        match intensities {
            Intensities::U8(values) => (TextureFormat::R8Unorm, Cow::Borrowed(values), u8::MAX as f64),
            Intensities::U16(values) => {
                let largest = u16::MAX as f64;
                let unit = |value: &u16| (*value as f64 / largest) as f32;
                let bytes = match self.intensity16 {
                    TextureFormat::R16Unorm => Cow::Borrowed(bytemuck::cast_slice(values)),
                    TextureFormat::R32Float => {
                        Cow::Owned(values.iter().flat_map(|value| unit(value).to_ne_bytes()).collect())
                    }
                    _ => Cow::Owned(
                        values
                            .iter()
                            .flat_map(|value| half::f16::from_f32(unit(value)).to_ne_bytes())
                            .collect(),
                    ),
                };
                (self.intensity16, bytes, largest)
            }
        }
    }
}

/// Describes a 3D texture of one value per voxel or brick. Passes read the texture and, with `STORAGE_BINDING`, write
/// it.
pub(crate) fn volume_texture(
    label: &'static str,
    dimensions: UVec3,
    format: TextureFormat,
    usage: TextureUsages,
) -> TextureDescriptor<'static> {
    TextureDescriptor {
        label: Some(label),
        size: Extent3d { width: dimensions.x, height: dimensions.y, depth_or_array_layers: dimensions.z },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D3,
        format,
        usage: usage | TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_SRC,
        view_formats: &[],
    }
}
