//! Pass that shares the listed words out to the slices of a ray cast, and reads back how many it
//! casts and how many wait.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroup, BindGroupLayoutEntries, Buffer, CommandEncoder, PipelineCache, ShaderStages,
        binding_types::{storage_buffer_sized, uniform_buffer},
    },
};

use super::{
    kept::{KeptRays, RayPassUniform},
    waiting::READ_BYTES,
};
use crate::render::{
    gpu::{
        compute_pass::{ComputePass, Groups, PassDescriptor},
        device::Gpu,
    },
    volumes::bricks::BrickResources,
};

/// Place of what is read back in `CastState` in WGSL, bytes.
const READ_FROM: u64 = 4;

/// A pass of one invocation.
#[derive(Deref)]
pub(super) struct SharePass(ComputePass);

/// The words of one volume.
pub(super) struct ShareJob {
    group: BindGroup,
    /// The state, and a buffer into which a part of it is copied.
    read: Option<(Buffer, Buffer)>,
}

impl FromWorld for SharePass {
    fn from_world(world: &mut World) -> Self {
        let written = storage_buffer_sized(false, None);
        let settings = uniform_buffer::<RayPassUniform>(false);
        let own = BindGroupLayoutEntries::sequential(ShaderStages::COMPUTE, (settings, written, written));
        let descriptor = PassDescriptor {
            name: "contextual_ao_share",
            shader: load_embedded_asset!(world, "share.wgsl"),
            own: &own,
            ..default()
        };
        Self(ComputePass::new(world, descriptor))
    }
}

impl SharePass {
    /// Binds the words of a volume. `reads_back`: buffer for a part of the state.
    pub fn bind_volume(
        &self,
        bricks: &BrickResources,
        kept: &mut KeptRays,
        reads_back: Option<Buffer>,
        gpu: &Gpu,
    ) -> Option<ShareJob> {
        let (settings, state) = (kept.pass.buffer()?, kept.state.as_ref()?);
        let bound = [settings.id(), state.id(), bricks.word_list.id()];
        let group = kept.share_group.of(bound, || {
            let buffers = [settings, &bricks.word_list, state];
            let [settings, words, state] = buffers.map(|buffer| buffer.as_entire_binding());
            self.bind((settings, words, state), &gpu.cache, &gpu.device)
        });
        Some(ShareJob { group, read: reads_back.map(|staging| (state.clone(), staging)) })
    }

    pub fn encode_job(&self, encoder: &mut CommandEncoder, job: &ShareJob, cache: &PipelineCache) {
        self.encode(encoder, [&job.group], Groups::Square(1), cache);
        if let Some((state, staging)) = &job.read {
            encoder.copy_buffer_to_buffer(state, READ_FROM, staging, 0, READ_BYTES);
        }
    }
}
