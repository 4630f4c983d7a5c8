//! Resources that rays keep on the GPU for a volume.

use bevy::{
    prelude::*,
    render::{
        render_resource::{
            BindGroup, Buffer, BufferDescriptor, BufferId, BufferUsages, ShaderType, StorageBuffer,
            TextureViewId, UniformBuffer,
        },
        renderer::RenderDevice,
    },
};

use super::{fill::KeptFill, slices::Slices, table::ray_table, waiting::WaitingWords};
use crate::{
    diagnostics::GpuUsage,
    occlusion::{AmbientOcclusion, MethodSettings, ProgressiveRays},
    render::{
        gpu::{device::Gpu, kept_group::KeptGroup, textures::usage_of_buffers},
        methods::voxel_method::KeptVolume,
        views::dispatch::ViewArray,
        volumes::kept::{LatestCast, MethodResources},
        windows::WindowUniform,
    },
};

/// Rays that a frame casts, `RayPass` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct RayPassUniform {
    pub first_ray: u32,
    pub end_ray: u32,
    pub all_rays: u32,
    pub steps: u32,
    pub ends_early: u32,
    pub leaps: u32,
    pub kept: f32,
    pub words_per_slice: u32,
    pub words_per_frame: u32,
    pub slices: u32,
}

/// Part of a view, `Part` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct Part {
    pub first: UVec2,
    pub end: UVec2,
    pub place_margin: f32,
    pub padding: f32,
    pub more_padding: Vec2,
}

/// Parts of a volume's views, and their bind group.
#[derive(Default)]
pub(super) struct MarkParts {
    pub parts: ViewArray<Part>,
    pub group: KeptGroup<[BufferId; 4]>,
    /// Bind group of the list of voxels.
    pub words: KeptGroup<BufferId>,
}

/// Resources kept for a volume.
#[derive(Default)]
pub(crate) struct KeptRays {
    pub rays: StorageBuffer<Vec<Vec4>>,
    /// Settings for which the rays were made.
    rays_for: Option<AmbientOcclusion>,
    pub pass: UniformBuffer<RayPassUniform>,
    /// Running means of progressive rays (`running_mean.wgsl`).
    pub running_means: Option<Buffer>,
    /// Whether no frame has used the running means yet.
    pub(super) means_are_new: bool,
    /// The ray with which the next frame begins.
    pub(super) next_ray: u32,
    /// Number of frames until all progressive rays have been cast where the last change was.
    pub(super) frames_left: u32,
    pub(super) go_on_groups: KeptGroup<[BufferId; 2], [BindGroup; 2]>,
    pub(super) parts: MarkParts,
    pub(super) fill: KeptFill,
    /// `CastState` in WGSL.
    pub state: Option<Buffer>,
    pub(super) waiting: WaitingWords,
    pub(super) share_group: KeptGroup<[BufferId; 3]>,
    pub(super) cast_group: KeptGroup<([BufferId; 4], TextureViewId)>,
    /// Views that read only valid occlusion.
    pub marked: Vec<WindowUniform>,
}

impl MethodResources for KeptRays {
    fn usage(&self) -> GpuUsage {
        usage_of_buffers(&self.running_means)
    }

    fn is_complete(&self) -> bool {
        !self.waiting.any
    }

    fn latest_cast(&self) -> Option<LatestCast<'_>> {
        Some(LatestCast { number: self.waiting.casts, state: self.state.as_ref()? })
    }
}

impl KeptRays {
    /// Makes the state of a cast in slices, if it is missing or is for fewer slices.
    pub(super) fn keep_state(&mut self, slices: Slices, device: &RenderDevice) {
        if self.state.as_ref().is_none_or(|state| state.size() < slices.state_bytes()) {
            self.state = Some(device.create_buffer(&BufferDescriptor {
                label: Some("contextual_ao_cast_state"),
                size: slices.state_bytes(),
                usage: BufferUsages::STORAGE
                    | BufferUsages::INDIRECT
                    | BufferUsages::COPY_SRC
                    | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }));
        }
    }

    /// Uploads the rays if they changed, and keeps running means only for progressive rays.
    pub fn update(mut self, volume: &KeptVolume, gpu: &Gpu) -> Self {
        let occlusion = volume.ambient_occlusion();
        if self.rays_for.as_ref() != Some(occlusion) {
            // Means of other rays would not settle: new ones are empty. Without progressive rays there are none.
            let bytes =
                volume.settings::<ProgressiveRays>().map(|rays| rays.bytes(volume.dimensions()).total);
            self.running_means = bytes.map(|size| {
                gpu.device.create_buffer(&BufferDescriptor {
                    label: Some("contextual_ao_running_means"),
                    size,
                    usage: BufferUsages::STORAGE,
                    mapped_at_creation: false,
                })
            });
            self.means_are_new = self.running_means.is_some();
            (self.next_ray, self.frames_left) = (0, 0);
            self.rays_for = Some(occlusion.clone());
            self.rays.set(ray_table(occlusion, &volume.volume.geometry));
            self.rays.write_buffer(&gpu.device, &gpu.queue);
        }
        self
    }
}
