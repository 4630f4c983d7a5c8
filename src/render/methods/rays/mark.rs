//! Pass that marks the voxels a view will read.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroup, BindGroupLayoutEntries, ShaderStages, UniformBuffer, binding_types::uniform_buffer,
    },
};

use crate::render::{
    gpu::{
        compute_pass::{ComputePass, PassDescriptor},
        device::Gpu,
        uniforms::write_if_changed,
    },
    volumes::{bricks::work_layout, layouts::bricks_layout},
    windows::WindowUniform,
};

/// One view to follow.
pub(crate) struct MarkJob {
    pub window: BindGroup,
    pub pixels: UVec2,
}

/// Uniform and bind group of a followed view. Any view can use them.
#[derive(Default)]
pub(super) struct MarkWindow {
    uniform: UniformBuffer<WindowUniform>,
    group: Option<BindGroup>,
}

/// Follows the rays of a view.
#[derive(Deref)]
pub(crate) struct MarkPass(ComputePass);

impl FromWorld for MarkPass {
    fn from_world(world: &mut World) -> Self {
        let own =
            BindGroupLayoutEntries::single(ShaderStages::COMPUTE, uniform_buffer::<WindowUniform>(false));
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
    pub(super) fn bind_window(
        &self,
        window: WindowUniform,
        kept: &mut MarkWindow,
        gpu: &Gpu,
    ) -> Option<MarkJob> {
        let MarkWindow { uniform, group } = kept;
        write_if_changed(uniform, window, &gpu.device, &gpu.queue);
        let binding = uniform.binding()?;
        let group = group.get_or_insert_with(|| self.bind((binding,), &gpu.cache, &gpu.device));
        Some(MarkJob { window: group.clone(), pixels: window.end - window.first })
    }
}
