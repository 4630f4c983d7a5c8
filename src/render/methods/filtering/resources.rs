//! Resources that filtering keeps on the GPU for a volume.

use bevy::{
    prelude::*,
    render::{
        render_resource::{
            BindingResource, Buffer, BufferDescriptor, BufferUsages, ShaderType, StorageBuffer, TextureView,
        },
        renderer::RenderDevice,
    },
};

use super::steps::{self, Outcome, Quantity, Step};
use crate::{
    diagnostics::GpuUsage,
    occlusion::{DensitySource, OcclusionFiltering, OpacityModulation},
    render::{extract::ExtractedVolume, gpu::textures::usage_of_buffers, volumes::kept::MethodResources},
};

/// The settings as shaders read them, `Filtering` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct FilteringData {
    dimensions: UVec3,
    estimate: u32,
    radii: UVec3,
    is_of_intensities: u32,
    lowest: f32,
    per_intensity: f32,
    brightness: f32,
    threshold: f32,
}

impl FilteringData {
    /// `intensities` are the lowest and the highest intensity, as the texture gives them.
    fn new(settings: &OcclusionFiltering, volume: &ExtractedVolume, intensities: [f64; 2]) -> Self {
        let [lowest, highest] = intensities;
        let range = highest - lowest;
        Self {
            dimensions: volume.geometry.dimensions,
            estimate: settings.estimate as u32,
            radii: settings.radii(&volume.geometry),
            is_of_intensities: (settings.density == DensitySource::Intensity).into(),
            lowest: lowest as f32,
            per_intensity: if range == 0.0 { 0.0 } else { range.recip() as f32 },
            brightness: settings.brightness,
            threshold: match settings.modulation {
                OpacityModulation::None => 0.0,
                OpacityModulation::Variance(threshold) | OpacityModulation::Gradient(threshold) => threshold,
            },
        }
    }
}

/// Settings and buffers of one volume. Each quantity has two buffers of one word a voxel, and is filtered from one to
/// the other.
pub(crate) struct FilteringResources {
    pub settings: OcclusionFiltering,
    pub dimensions: UVec3,
    pub data: StorageBuffer<FilteringData>,
    buffers: Vec<(Quantity, [Buffer; 2])>,
    /// Whether the occlusion is up to date.
    pub is_valid: bool,
}

impl MethodResources for FilteringResources {
    fn usage(&self) -> GpuUsage {
        usage_of_buffers(self.buffers.iter().flat_map(|(_, pair)| pair))
    }
}

impl FilteringResources {
    /// Makes the resources that a volume's settings need, and reuses earlier ones as far as possible.
    pub fn kept(
        before: Option<Self>,
        settings: OcclusionFiltering,
        volume: &ExtractedVolume,
        intensities: [f64; 2],
        device: &RenderDevice,
    ) -> Self {
        let is_valid = before.as_ref().is_some_and(|kept| kept.is_valid);
        let dimensions = volume.geometry.dimensions;
        let size = 4 * dimensions.as_u64vec3().element_product();
        let buffer = |label| {
            let usage = BufferUsages::STORAGE;
            let descriptor = BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
            device.create_buffer(&descriptor)
        };
        let (mut buffers, data) = before.map(|kept| (kept.buffers, kept.data)).unwrap_or_default();
        let needed = steps::quantities(&settings);
        buffers.retain(|(quantity, _)| needed.contains(quantity));
        for quantity in needed {
            if buffers.iter().all(|(kept, _)| *kept != quantity) {
                buffers
                    .push((quantity, ["contextual_ao_filtered", "contextual_ao_other_filtered"].map(buffer)));
            }
        }
        let mut kept = Self { settings, dimensions, data, buffers, is_valid };
        kept.data.set(FilteringData::new(&settings, volume, intensities));
        kept
    }

    /// Buffers of a quantity. The mean's buffers, which always exist, replace missing ones.
    fn pair(&self, quantity: Quantity) -> Option<&[Buffer; 2]> {
        let found = self.buffers.iter().find(|(kept, _)| *kept == quantity);
        found.or_else(|| self.buffers.iter().find(|(kept, _)| *kept == Quantity::Mean)).map(|(_, pair)| pair)
    }

    /// Bindings of a step, behind those shared by all steps. `occlusion` is the texture of the results.
    pub(super) fn bindings<'a>(&'a self, step: Step, occlusion: &'a TextureView) -> Vec<BindingResource<'a>> {
        let buffer = |quantity, place: usize| self.pair(quantity).map(|pair| pair[place].as_entire_binding());
        // The spare buffer holds densities before there are means, and shares once means are no longer read.
        let spare = buffer(Quantity::Mean, 1);
        let texture = Some(BindingResource::TextureView(occlusion));
        let bindings = match step {
            Step::Densities => vec![spare],
            Step::Filter { quantity, turn: 0 } => vec![spare, buffer(quantity, 0)],
            Step::Filter { quantity, turn } => {
                vec![buffer(quantity, 1 - turn % 2), buffer(quantity, turn % 2)]
            }
            Step::Estimate(outcome) => {
                let target = if outcome == Outcome::Shares { spare } else { texture };
                let [mean, extrema, square] =
                    [Quantity::Mean, Quantity::Extrema, Quantity::Square].map(|found| buffer(found, 0));
                vec![mean, extrema, square, target]
            }
            Step::Gradient => vec![spare, texture],
        };
        bindings.into_iter().flatten().collect()
    }
}
