//! Lists the superbricks in which a change of carvers may matter, alone and with their neighbours.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutEntries, CommandEncoder, PipelineCache, ShaderStages,
            binding_types::{storage_buffer_read_only, storage_buffer_sized, uniform_buffer},
        },
        renderer::RenderDevice,
    },
};

use crate::render::{
    gpu::compute_pass::{ComputePass, Groups, PassDescriptor, are_ready},
    volumes::{
        bricks::work_layout, carver_uniform::CarverUniform, clip_pass::ClipPassUniform, layouts,
        store::VolumeResources,
    },
};

/// Passes over a box of superbricks.
#[derive(Resource)]
pub(crate) struct CullSuperbrickPasses {
    cull: ComputePass,
    widen: ComputePass,
}

/// First and end of a box of superbricks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct SuperbrickBox {
    pub first: UVec3,
    pub end: UVec3,
}

impl SuperbrickBox {
    /// The box with a superbrick more on every side, as far as there are any.
    pub fn widened(self, counts: UVec3) -> Self {
        Self { first: self.first.saturating_sub(UVec3::ONE), end: (self.end + 1).min(counts) }
    }

    /// Number of superbricks in the box.
    pub fn count(self) -> u32 {
        self.end.saturating_sub(self.first).element_product()
    }
}

impl FromWorld for CullSuperbrickPasses {
    fn from_world(world: &mut World) -> Self {
        let own = BindGroupLayoutEntries::with_indices(
            ShaderStages::COMPUTE,
            (
                (2, uniform_buffer::<ClipPassUniform>(false)),
                (3, storage_buffer_read_only::<Vec<CarverUniform>>(false)),
                (6, storage_buffer_sized(false, None)),
            ),
        );
        let shader: Handle<Shader> = load_embedded_asset!(world, "cull_superbricks.wgsl");
        let pass = |name, entry_point| {
            let descriptor = PassDescriptor {
                name,
                shader: shader.clone(),
                entry_point: Some(entry_point),
                before: vec![layouts::compute_layout()],
                own: &own,
                behind: vec![work_layout()],
                ..default()
            };
            ComputePass::new(world, descriptor)
        };
        Self {
            cull: pass("contextual_ao_cull_superbricks", "cull_superbricks"),
            widen: pass("contextual_ao_widen", "widen"),
        }
    }
}

impl CullSuperbrickPasses {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        are_ready([&self.cull, &self.widen], cache)
    }

    pub fn bind_volume(
        &self,
        volume: &VolumeResources,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> Option<BindGroup> {
        let entries = BindGroupEntries::with_indices((
            (2, volume.pass.binding()?),
            (3, volume.changes.binding()?),
            (6, volume.bricks.superbricks.as_entire_binding()),
        ));
        Some(self.cull.bind_entries(&entries, cache, device))
    }

    /// Lists the superbricks of a box, and then those of the wider box.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        groups: [&BindGroup; 3],
        [changed, wider]: [SuperbrickBox; 2],
        cache: &PipelineCache,
    ) {
        self.cull.encode(encoder, groups, Groups::Invocations(changed.count()), cache);
        self.widen.encode(encoder, groups, Groups::Invocations(wider.count()), cache);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wider_box_stays_within_the_grid() {
        let counts = UVec3::new(8, 8, 3);
        let corner = SuperbrickBox { first: UVec3::ZERO, end: UVec3::new(1, 2, 3) };
        assert_eq!(corner.count(), 6);
        let wider = SuperbrickBox { first: UVec3::ZERO, end: UVec3::new(2, 3, 3) };
        assert_eq!(corner.widened(counts), wider);
        // A carver beside the volume changes nothing.
        let beside = SuperbrickBox { first: UVec3::splat(3), end: UVec3::new(2, 5, 3) };
        assert_eq!(beside.count(), 0);
    }
}
