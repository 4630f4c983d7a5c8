//! Resources that rays keep on the GPU for a volume.

use bevy::{
    prelude::*,
    render::render_resource::{
        Buffer, BufferDescriptor, BufferUsages, ShaderType, StorageBuffer, UniformBuffer,
    },
};

use super::table::ray_table;
use crate::{
    diagnostics::GpuUsage,
    occlusion::{AmbientOcclusion, ProgressiveRays},
    render::{
        gpu::{device::Gpu, kept_group::KeptGroup, textures::usage_of_buffers},
        methods::voxel_method::KeptVolume,
        views::dispatch::ViewArray,
        volumes::kept::MethodResources,
        windows::WindowUniform,
    },
};

/// Rays that a frame casts, `RayPass` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct RayPassUniform {
    pub first_ray: u32,
    pub end_ray: u32,
    pub steps: u32,
    pub ends_early: u32,
    pub leaps: u32,
    pub kept: f32,
    pub found_weight: f32,
    pub goes_on: u32,
}

/// Progress of rays that are cast over several frames.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct RayProgress {
    pub rays: u32,
    pub weight: f32,
}

/// Part of a view, `Part` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct Part {
    pub first: UVec2,
    pub end: UVec2,
}

/// Parts of a volume's views, and their bind group.
#[derive(Default)]
pub(super) struct MarkParts {
    pub parts: ViewArray<Part>,
    pub group: KeptGroup<3>,
}

/// Resources kept for a volume.
#[derive(Default)]
pub(crate) struct KeptRays {
    pub rays: StorageBuffer<Vec<Vec4>>,
    /// Settings for which the rays were made.
    rays_for: Option<AmbientOcclusion>,
    pub pass: UniformBuffer<RayPassUniform>,
    /// Sums of progressive rays' weighted factors so far, one number a voxel.
    pub ray_sums: Option<Buffer>,
    /// Number of rays cast since the last change, and total weight of the sums.
    pub(super) progress: RayProgress,
    pub(super) parts: MarkParts,
    /// Views that read only valid occlusion.
    pub marked: Vec<WindowUniform>,
}

impl MethodResources for KeptRays {
    fn usage(&self) -> GpuUsage {
        usage_of_buffers(&self.ray_sums)
    }
}

impl KeptRays {
    /// Uploads the rays if they changed, and keeps sums only for progressive rays.
    pub fn update(mut self, volume: &KeptVolume, gpu: &Gpu) -> Self {
        let is_progressive = volume.settings::<ProgressiveRays>().is_some();
        if is_progressive != self.ray_sums.is_some() {
            let descriptor = BufferDescriptor {
                label: Some("contextual_ao_ray_sums"),
                size: 4 * volume.dimensions().as_u64vec3().element_product(),
                usage: BufferUsages::STORAGE,
                mapped_at_creation: false,
            };
            self.ray_sums = is_progressive.then(|| gpu.device.create_buffer(&descriptor));
            // The new sums are empty, whatever the earlier sums held.
            self.progress = default();
        }
        let occlusion = volume.ambient_occlusion();
        if self.rays_for.as_ref() != Some(occlusion) {
            self.rays_for = Some(occlusion.clone());
            self.rays.set(ray_table(occlusion, &volume.volume.geometry));
            self.rays.write_buffer(&gpu.device, &gpu.queue);
        }
        self
    }
}
