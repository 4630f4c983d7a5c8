//! Pass that marks the voxels that views will read.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroup, BindGroupEntry, CommandEncoder, PipelineCache, ShaderStages,
        binding_types::{storage_buffer_read_only_sized, uniform_buffer_sized},
    },
};

use super::kept::{KeptRays, MarkParts, Part};
use crate::render::{
    gpu::{
        compute_pass::{ComputePass, PassDescriptor},
        device::Gpu,
    },
    methods::voxel_method::VolumeFrame,
    views::{
        dispatch::{VIEWS_AT_ONCE, ViewArray, ViewParts, encode_views},
        runs::{MarchedViewUniform, RUNS_BINDING},
    },
    volumes::{
        bricks::{work_group, work_layout},
        layouts::bricks_layout,
    },
    windows::WindowUniform,
};

/// The views of one volume.
pub(crate) struct MarkJob {
    views: BindGroup,
    /// Bind group of the list of voxels.
    words: BindGroup,
    parts: ViewParts,
}

/// Marks the voxels around the runs of views.
#[derive(Deref)]
pub(crate) struct MarkPass(ComputePass);

impl FromWorld for MarkPass {
    fn from_world(world: &mut World) -> Self {
        let views = uniform_buffer_sized(true, None);
        let runs = storage_buffer_read_only_sized(false, None);
        let bindings = [(0, views), (1, views), (2, runs), (RUNS_BINDING, runs)];
        let own = bindings.map(|(binding, entry)| entry.build(binding, ShaderStages::COMPUTE));
        let descriptor = PassDescriptor {
            name: "contextual_ao_mark",
            shader: load_embedded_asset!(world, "mark.wgsl"),
            before: vec![bricks_layout()],
            own: &own,
            behind: vec![work_layout()],
            ..default()
        };
        Self(ComputePass::new(world, descriptor))
    }
}

impl MarkPass {
    /// Binds the views of a volume, each with the part to mark.
    pub(super) fn bind_views(
        &self,
        unmarked: &[Option<WindowUniform>],
        place_margin: f32,
        kept: &mut KeptRays,
        frame: &VolumeFrame,
        gpu: &Gpu,
    ) -> Option<MarkJob> {
        // All rays of outlines may read something else, wherever something changed.
        let parts = unmarked.iter().map(|part| part.unwrap_or_default()).chain(frame.runs.outline_windows());
        let parts: Vec<_> = parts
            .map(|WindowUniform { first, end, .. }| Part { first, end, place_margin, ..default() })
            .collect();
        let largest = parts.iter().map(|part| part.end - part.first).reduce(UVec2::max)?;
        let count = parts.len() as u32;
        let MarkParts { parts: written, group, words } = &mut kept.parts;
        written.write(parts, gpu);
        let [views, runs, outlines] = frame.runs.buffers()?;
        let buffers = [views, written.buffer()?, runs, outlines];
        let views = group.of(buffers.map(|buffer| buffer.id()), || {
            let [views, parts, runs, outlines] = buffers;
            let views = ViewArray::<MarchedViewUniform>::binding(views, VIEWS_AT_ONCE);
            let parts = ViewArray::<Part>::binding(parts, VIEWS_AT_ONCE);
            let [runs, outlines] = [runs, outlines].map(|buffer| buffer.as_entire_binding());
            let entries = [(0, views), (1, parts), (2, outlines), (RUNS_BINDING, runs)];
            let entries = entries.map(|(binding, resource)| BindGroupEntry { binding, resource });
            self.0.bind_entries(&entries, &gpu.cache, &gpu.device)
        });
        let bricks = &frame.resources.bricks;
        Some(MarkJob {
            views,
            words: words
                .of(bricks.word_list.id(), || work_group(bricks, &bricks.word_list, &gpu.cache, &gpu.device)),
            parts: ViewParts { largest, first: 0, count },
        })
    }

    /// Encodes the pass over all views.
    pub fn encode_views(
        &self,
        encoder: &mut CommandEncoder,
        volume: &BindGroup,
        job: &MarkJob,
        cache: &PipelineCache,
    ) {
        let groups = [volume, &job.views, &job.words];
        let bytes = [ViewArray::<MarchedViewUniform>::BYTES, ViewArray::<Part>::BYTES];
        encode_views(self, encoder, &groups, &bytes, job.parts, cache);
    }
}
