//! Pass that marks the voxels that views will read.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroup, BindGroupEntry, BindingResource, BufferBinding, BufferSize, BufferUsages, CommandEncoder,
        PipelineCache, ShaderStages,
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
        dispatch::{VIEWS_AT_ONCE, ViewParts, encode_views},
        runs::MarchedViewUniform,
    },
    volumes::{
        bricks::{work_group, work_layout},
        layouts::bricks_layout,
    },
    windows::WindowUniform,
};

/// Binding of the runs (`seen.wgsl`).
const RUNS: u32 = 11;

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
        let bindings = [(0, views), (1, views), (RUNS, runs)];
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
        kept: &mut KeptRays,
        frame: &VolumeFrame,
        gpu: &Gpu,
    ) -> Option<MarkJob> {
        let parts = unmarked.iter().map(|part| part.unwrap_or_default());
        let mut parts: Vec<_> = parts.map(|WindowUniform { first, end, .. }| Part { first, end }).collect();
        let largest = parts.iter().map(|part| part.end - part.first).reduce(UVec2::max)?;
        let count = parts.len() as u32;
        // Whole arrays are bound.
        parts.resize(parts.len().next_multiple_of(VIEWS_AT_ONCE as usize), default());
        let MarkParts { parts: written, group } = &mut kept.parts;
        if *written.get() != parts {
            written.add_usages(BufferUsages::UNIFORM);
            written.set(parts);
            written.write_buffer(&gpu.device, &gpu.queue);
        }
        let written = written.buffer()?;
        let [views, runs] = frame.runs.buffers()?;
        let ids = [views.id(), written.id(), runs.id()];
        if group.as_ref().is_none_or(|(bound, _)| *bound != ids) {
            let size = BufferSize::new((VIEWS_AT_ONCE * Part::BYTES).into());
            let parts = BindingResource::Buffer(BufferBinding { buffer: written, offset: 0, size });
            let views = MarchedViewUniform::binding(views, VIEWS_AT_ONCE);
            let entries = [(0, views), (1, parts), (RUNS, runs.as_entire_binding())];
            let entries = entries.map(|(binding, resource)| BindGroupEntry { binding, resource });
            *group = Some((ids, self.0.bind_entries(&entries, &gpu.cache, &gpu.device)));
        }
        let bricks = &frame.resources.bricks;
        Some(MarkJob {
            views: group.as_ref()?.1.clone(),
            words: work_group(bricks, &bricks.word_list, &gpu.cache, &gpu.device),
            parts: ViewParts { largest, count },
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
        let bytes = [MarchedViewUniform::BYTES, Part::BYTES];
        encode_views(self, encoder, &groups, &bytes, job.parts, cache);
    }
}
