//! Pass that gives texels without valid occlusion the factor of an open flat surface (`fill.wgsl`). What waits for its
//! rays is not dark.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroup, BindGroupLayoutEntries, CommandEncoder, PipelineCache, ShaderStages, StorageTextureAccess,
        TextureViewId, UniformBuffer,
        binding_types::{storage_buffer_read_only_sized, texture_storage_3d, uniform_buffer},
    },
};

use crate::render::{
    gpu::{
        compute_pass::{ComputePass, Groups, PassDescriptor},
        device::Gpu,
        uniforms::write_if_changed,
    },
    methods::voxel_method::{VolumeFrame, factor_format},
    volumes::layouts::bricks_layout,
};

/// One invocation for each texel.
#[derive(Deref)]
pub(super) struct FillPass(ComputePass);

/// The texels of one volume.
pub(super) struct FillJob {
    group: BindGroup,
    texels: UVec3,
}

/// What the texture of a volume was filled with.
#[derive(Default)]
pub(super) struct KeptFill {
    factor: UniformBuffer<f32>,
    texture: Option<TextureViewId>,
}

impl KeptFill {
    /// Whether a texture is to be filled: a new one always, and one with the factor of another sky only `at_rest`.
    /// What is known is not lost while it is all that can be shown.
    pub fn is_due(&self, frame: &VolumeFrame, at_rest: bool) -> bool {
        let is_new = self.texture != Some(frame.resources.occlusion.view.id());
        is_new || at_rest && *self.factor.get() != flat_factor(frame)
    }
}

/// Factor of an open flat surface: what drawing divides by.
fn flat_factor(frame: &VolumeFrame) -> f32 {
    frame.volume.occlusion.flat_factor(&frame.volume.geometry) as f32
}

impl FromWorld for FillPass {
    fn from_world(world: &mut World) -> Self {
        let own = BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                uniform_buffer::<f32>(false),
                storage_buffer_read_only_sized(false, None),
                texture_storage_3d(factor_format(world), StorageTextureAccess::WriteOnly),
            ),
        );
        let descriptor = PassDescriptor {
            name: "contextual_ao_fill",
            shader: load_embedded_asset!(world, "fill.wgsl"),
            before: vec![bricks_layout()],
            own: &own,
            ..default()
        };
        Self(ComputePass::new(world, descriptor))
    }
}

impl FillPass {
    /// Binds the texels of a volume, and records them as filled: a planned pass always runs.
    pub fn bind_volume(&self, kept: &mut KeptFill, frame: &VolumeFrame, gpu: &Gpu) -> Option<FillJob> {
        write_if_changed(&mut kept.factor, flat_factor(frame), &gpu.device, &gpu.queue);
        let occlusion = &frame.resources.occlusion;
        kept.texture = Some(occlusion.view.id());
        let masks = frame.resources.bricks.voxel_masks.as_entire_binding();
        let group = self.bind((kept.factor.binding()?, masks, &occlusion.view), &gpu.cache, &gpu.device);
        Some(FillJob { group, texels: frame.volume.occlusion.texels().size(frame.dimensions()) })
    }

    pub fn encode_job(
        &self,
        encoder: &mut CommandEncoder,
        volume: &BindGroup,
        job: &FillJob,
        cache: &PipelineCache,
    ) {
        self.encode(encoder, [volume, &job.group], Groups::Voxels(job.texels), cache);
    }
}
