//! The pass that lists pixels at outlines, whose rays are then marched.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroup, BindGroupEntry, ShaderStages,
        binding_types::{storage_buffer_read_only_sized, storage_buffer_sized, uniform_buffer_sized},
    },
};

use super::{
    dispatch::{VIEWS_AT_ONCE, ViewArray},
    runs::{MarchedViewUniform, ViewRuns},
};
use crate::render::{
    gpu::{
        compute_pass::{ComputePass, PassDescriptor},
        device::Gpu,
    },
    volumes::layouts::bricks_layout,
};

/// Finds the pixels at outlines of volumes.
#[derive(Deref)]
pub(super) struct OutlinePass(ComputePass);

impl FromWorld for OutlinePass {
    fn from_world(world: &mut World) -> Self {
        let runs = storage_buffer_read_only_sized(false, None);
        let bindings =
            [(0, uniform_buffer_sized(true, None)), (1, runs), (3, storage_buffer_sized(false, None))];
        let descriptor = PassDescriptor {
            name: "contextual_ao_outlines",
            shader: load_embedded_asset!(world, "outlines.wgsl"),
            before: vec![bricks_layout()],
            own: &bindings.map(|(binding, entry)| entry.build(binding, ShaderStages::COMPUTE)),
            ..default()
        };
        Self(ComputePass::new(world, descriptor))
    }
}

impl OutlinePass {
    /// Binds the views of a volume, with their runs and lists.
    pub fn bind_views(&self, runs: &mut ViewRuns, gpu: &Gpu) -> Option<BindGroup> {
        let ViewRuns { views, runs, outlines, outline_group, .. } = runs;
        let buffers = [views.buffer()?, runs.as_ref()?, outlines.as_ref()?];
        Some(outline_group.of(buffers.map(|buffer| buffer.id()), || {
            let [views, runs, outlines] = buffers;
            let views = ViewArray::<MarchedViewUniform>::binding(views, VIEWS_AT_ONCE);
            let entries = [(0, views), (1, runs.as_entire_binding()), (3, outlines.as_entire_binding())];
            let entries = entries.map(|(binding, resource)| BindGroupEntry { binding, resource });
            self.0.bind_entries(&entries, &gpu.cache, &gpu.device)
        }))
    }
}
