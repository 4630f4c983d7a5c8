//! Finds out how precisely the device interpolates texels, and so how far from a texel a view may still read it.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupLayoutEntries, Buffer, BufferDescriptor, BufferUsages, CommandEncoder,
            Extent3d, PipelineCache, SamplerBindingType, ShaderStages, TextureDataOrder, TextureDescriptor,
            TextureDimension, TextureFormat, TextureSampleType, TextureUsages,
            binding_types::{sampler, storage_buffer_sized, texture_3d},
        },
        renderer::{RenderDevice, RenderQueue},
    },
};

use crate::render::gpu::{
    compute_pass::{ComputePass, Groups, PassDescriptor},
    formats::Formats,
    readback::WordReadback,
};

/// Largest error of a fraction that Vulkan allows: 4 bits of it, rounded.
const WORST_ERROR: f32 = 1.0 / 32.0;
/// Least margin, texels: places are rounded as well.
const LEAST_MARGIN: f32 = 1.0 / 256.0;
/// Unit of the error that the pass finds.
const ERROR_UNIT: f32 = 1.0 / 65536.0;

/// One pass, run once. Until its result arrives, the device counts as imprecise as Vulkan allows.
pub(super) struct FilterProbe {
    pass: ComputePass,
    group: BindGroup,
    error: Buffer,
    readback: WordReadback<()>,
    /// Where this frame copies the result, if it runs the pass.
    staging: Option<Buffer>,
    found_error: Option<f32>,
}

impl FromWorld for FilterProbe {
    fn from_world(world: &mut World) -> Self {
        let own = BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                texture_3d(TextureSampleType::Float { filterable: true }),
                sampler(SamplerBindingType::Filtering),
                storage_buffer_sized(false, None),
            ),
        );
        let descriptor = PassDescriptor {
            name: "contextual_ao_filter_probe",
            shader: load_embedded_asset!(world, "filter_probe.wgsl"),
            own: &own,
            ..default()
        };
        let pass = ComputePass::new(world, descriptor);
        let (device, queue) = (world.resource::<RenderDevice>(), world.resource::<RenderQueue>());
        let texture = device.create_texture_with_data(
            queue,
            &TextureDescriptor {
                label: Some("contextual_ao_two_texels"),
                size: Extent3d { width: 2, ..default() },
                mip_level_count: 1,
                sample_count: 1,
                dimension: TextureDimension::D3,
                format: TextureFormat::R8Unorm,
                usage: TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            },
            TextureDataOrder::default(),
            &[0, 255],
        );
        let error = device.create_buffer(&BufferDescriptor {
            label: Some("contextual_ao_filter_error"),
            size: 4,
            usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let view = texture.create_view(&default());
        let resources = (&view, &world.resource::<Formats>().edge_sampler, error.as_entire_binding());
        let group = pass.bind(resources, world.resource::<PipelineCache>(), device);
        Self { pass, group, error, readback: default(), staging: None, found_error: None }
    }
}

impl FilterProbe {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        self.pass.is_ready(cache)
    }

    /// Begins a frame: takes over the result if it has arrived, and asks for it if nothing did.
    pub fn begin_frame(&mut self, device: &RenderDevice) {
        self.staging = None;
        if self.found_error.is_some() {
            return;
        }
        if let Some(((), error)) = self.readback.receive(device) {
            // 0 means that the pass has not run yet.
            self.found_error = error.checked_sub(1).map(|error| error as f32 * ERROR_UNIT);
        }
        if self.found_error.is_none() {
            self.staging = self.readback.begin((), device);
        }
    }

    /// Distance from a texel's cell, texels, up to which interpolation may read the texel.
    pub fn place_margin(&self) -> f32 {
        place_margin(self.found_error)
    }

    pub fn encode(&self, encoder: &mut CommandEncoder, cache: &PipelineCache) {
        if let Some(staging) = &self.staging {
            self.pass.encode(encoder, [&self.group], Groups::Square(1), cache);
            encoder.copy_buffer_to_buffer(&self.error, 0, staging, 0, 4);
        }
    }
}

fn place_margin(error: Option<f32>) -> f32 {
    (2.0 * error.unwrap_or(WORST_ERROR)).max(LEAST_MARGIN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_margin_covers_the_devices_rounding() {
        // Not known yet: 4 bits, which round places by up to 1/32 of a texel.
        assert_eq!(place_margin(None), 1.0 / 16.0);
        // 8 bits, with the quantum of the probe's texture.
        let eight_bits = place_margin(Some(1.0 / 512.0 + 0.5 / 255.0));
        assert!(eight_bits > 1.0 / 256.0 && eight_bits < 1.0 / 100.0, "{eight_bits}");
        // An exact device rounds places all the same.
        assert_eq!(place_margin(Some(0.0)), 1.0 / 256.0);
    }
}
