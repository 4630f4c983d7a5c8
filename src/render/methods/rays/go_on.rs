//! Pass that lists the voxels whose progressive rays go on.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroup, BindGroupEntry, Buffer, CommandEncoder, PipelineCache, ShaderStages,
        binding_types::storage_buffer_sized,
    },
};

use super::kept::KeptRays;
use crate::render::{
    gpu::{
        compute_pass::{ComputePass, Groups, PassDescriptor},
        device::Gpu,
    },
    volumes::{
        bricks::{BrickResources, MASK_WORDS, work_group, work_layout},
        layouts::bricks_layout,
    },
};

/// Binding of the running means, in the ray cast too.
pub(super) const RUNNING_MEANS: u32 = 8;

/// One invocation for each word of voxels.
#[derive(Deref)]
pub(super) struct GoOnPass(ComputePass);

/// The words of one volume.
pub(super) struct GoOnJob {
    means: BindGroup,
    words: BindGroup,
    count: u32,
}

impl FromWorld for GoOnPass {
    fn from_world(world: &mut World) -> Self {
        let descriptor = PassDescriptor {
            name: "contextual_ao_go_on",
            shader: load_embedded_asset!(world, "go_on.wgsl"),
            before: vec![bricks_layout()],
            own: &[storage_buffer_sized(false, None).build(RUNNING_MEANS, ShaderStages::COMPUTE)],
            behind: vec![work_layout()],
            ..default()
        };
        Self(ComputePass::new(world, descriptor))
    }
}

impl GoOnPass {
    /// Binds the words of a volume with progressive rays.
    pub fn bind_volume(&self, bricks: &BrickResources, kept: &mut KeptRays, gpu: &Gpu) -> Option<GoOnJob> {
        let means: &Buffer = kept.running_means.as_ref()?;
        let (cache, device) = (&gpu.cache, &gpu.device);
        let bound = [means.id(), bricks.word_list.id()];
        let [means, words] = kept.go_on_groups.of(bound, || {
            let entry = BindGroupEntry { binding: RUNNING_MEANS, resource: means.as_entire_binding() };
            let means = self.bind_entries(&[entry], cache, device);
            [means, work_group(bricks, &bricks.word_list, cache, device)]
        });
        Some(GoOnJob { means, words, count: bricks.bricks * MASK_WORDS })
    }

    pub fn encode_job(
        &self,
        encoder: &mut CommandEncoder,
        volume: &BindGroup,
        job: &GoOnJob,
        cache: &PipelineCache,
    ) {
        self.encode(encoder, [volume, &job.means, &job.words], Groups::Invocations(job.count), cache);
    }
}
