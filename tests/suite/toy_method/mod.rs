//! An occlusion method from outside of the crate, as `docs/adding_a_method.md` shows it. It takes this folder, its
//! settings, and a line that adds its plugin.

mod settings;

use bevy::{
    prelude::*,
    render::render_resource::{
        BindGroup, BindGroupLayoutEntries, PipelineCache, ShaderStages, StorageTextureAccess,
        TextureSampleType, UniformBuffer,
        binding_types::{texture_3d, texture_storage_3d, uniform_buffer},
    },
};
use bevy_contextual_ao::{
    diagnostics::GpuUsage,
    occlusion::OcclusionMethod,
    render::{
        ComputePass, Frame, Gpu, Groups, KeptVolume, MethodResources, PassDescriptor, VolumeFrame,
        VoxelMethod, factor_format, volume_layout,
    },
};

pub use settings::Openness;

/// The pass of openness.
pub struct OpennessMethod(ComputePass);

/// Resources kept for a volume.
#[derive(Default)]
pub struct Kept {
    distance: UniformBuffer<i32>,
    is_valid: bool,
}

/// The pass over one volume.
pub struct Job {
    groups: [BindGroup; 2],
    dimensions: UVec3,
}

impl MethodResources for Kept {
    fn usage(&self) -> GpuUsage {
        // Only buffers that grow with the volume are counted.
        default()
    }
}

impl FromWorld for OpennessMethod {
    fn from_world(world: &mut World) -> Self {
        let own = BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                texture_3d(TextureSampleType::Float { filterable: true }),
                uniform_buffer::<i32>(false),
                texture_storage_3d(factor_format(world), StorageTextureAccess::WriteOnly),
            ),
        );
        let shader = Shader::from_wgsl(include_str!("openness.wgsl"), "toy/openness.wgsl");
        let descriptor = PassDescriptor {
            name: "openness",
            shader: world.resource::<AssetServer>().add(shader),
            before: vec![volume_layout()],
            own: &own,
            ..default()
        };
        Self(ComputePass::new(world, descriptor))
    }
}

impl VoxelMethod for OpennessMethod {
    type Kept = Kept;
    type Job = Job;

    fn computes(&self, method: &OcclusionMethod) -> bool {
        method.get::<Openness>().is_some()
    }

    fn is_ready(&self, _: &OcclusionMethod, cache: &PipelineCache) -> bool {
        self.0.is_ready(cache)
    }

    fn keep(&self, kept: Option<Kept>, _: &KeptVolume, _: &Gpu) -> Kept {
        kept.unwrap_or_default()
    }

    fn plan(&self, kept: &mut Kept, volume: &VolumeFrame, gpu: &Gpu) -> Option<Job> {
        kept.is_valid &= !volume.has_changed();
        if kept.is_valid || !volume.uses_occlusion() {
            return None;
        }
        let settings = volume.settings::<Openness>()?;
        kept.distance.set(settings.distance_voxels as i32);
        kept.distance.write_buffer(&gpu.device, &gpu.queue);
        let own = (volume.opacities(), kept.distance.binding()?, volume.occlusion());
        let groups = [volume.group().clone(), self.0.bind(own, &gpu.cache, &gpu.device)];
        kept.is_valid = true;
        Some(Job { groups, dimensions: volume.dimensions() })
    }

    fn encode(&self, jobs: &[Job], frame: &mut Frame, cache: &PipelineCache) {
        frame.pass(Openness::SPAN, jobs, |encoder, job| {
            self.0.encode(encoder, &job.groups, Groups::Voxels(job.dimensions), cache);
        });
    }
}
