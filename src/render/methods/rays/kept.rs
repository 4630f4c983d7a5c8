//! What rays keep on the GPU for a volume.

use bevy::{
    prelude::*,
    render::render_resource::{
        Buffer, BufferDescriptor, BufferUsages, ShaderType, StorageBuffer, UniformBuffer,
    },
};

use super::{mark::MarkWindow, table::ray_table};
use crate::{
    diagnostics::GpuUsage,
    occlusion::{AmbientOcclusion, ProgressiveRays},
    render::{
        gpu::{device::Gpu, textures::usage_of_buffers},
        methods::voxel_method::KeptVolume,
        volumes::kept::MethodResources,
        windows::WindowUniform,
    },
};

/// Which rays a frame casts, as `RayPass` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct RayPassUniform {
    pub first_ray: u32,
    pub end_ray: u32,
    pub steps: u32,
    pub ends_early: u32,
    pub leaps: u32,
    pub kept: f32,
    pub found_weight: f32,
}

/// How far rays are that are cast in several frames.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct RayProgress {
    pub rays: u32,
    pub weight: f32,
}

/// What is kept for a volume.
#[derive(Default)]
pub(crate) struct KeptRays {
    pub rays: StorageBuffer<Vec<Vec4>>,
    /// What the rays were made for.
    rays_for: Option<AmbientOcclusion>,
    pub pass: UniformBuffer<RayPassUniform>,
    /// Of progressive rays: the sum of what they found so far, a number a voxel.
    pub ray_sums: Option<Buffer>,
    /// Which rays have been cast since the last change, and the weight of all that was found.
    pub(super) progress: RayProgress,
    /// Of views that are followed.
    pub(super) windows: Vec<MarkWindow>,
    /// Views for which all occlusion that they read is valid.
    pub marked: Vec<WindowUniform>,
}

impl MethodResources for KeptRays {
    fn usage(&self) -> GpuUsage {
        usage_of_buffers(&self.ray_sums)
    }
}

impl KeptRays {
    /// Uploads the rays where they changed, and has sums where rays are progressive.
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
            // Nothing is in them, whatever was found when the volume was last seen.
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
