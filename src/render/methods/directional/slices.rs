//! The pass over the slices of a volume in a view.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, BindingResource,
            BufferBinding, BufferSize, CommandEncoder, PipelineCache, ShaderStages, StorageTextureAccess,
            TextureSampleType, TextureView,
            binding_types::{
                storage_buffer_read_only, storage_buffer_sized, texture_2d, texture_depth_2d,
                texture_depth_2d_multisampled, texture_storage_2d, uniform_buffer,
            },
        },
        renderer::RenderDevice,
    },
};

use super::{
    buffers::{Buffers, LIGHT_FORMAT, NUMBER_STRIDE},
    slicing::SlicingData,
};
use crate::render::{
    gpu::compute_pass::{ComputePass, PassDescriptor, are_ready},
    volumes::layouts::lit_layout,
    windows::WindowUniform,
};

/// Passes of views with one sample a pixel, and with several.
#[derive(Resource)]
pub(crate) struct DirectionalPasses {
    single: ComputePass,
    multisampled: ComputePass,
    /// Layout of the number of a slice.
    number_layout: BindGroupLayoutDescriptor,
}

/// The slices of one volume in one view.
pub(super) struct SlicesJob {
    pub volume: BindGroup,
    /// Bind groups of even and of odd slices.
    pub slices: [BindGroup; 2],
    pub number: BindGroup,
    pub count: u32,
    pub pixels: UVec2,
    pub is_multisampled: bool,
}

impl FromWorld for DirectionalPasses {
    fn from_world(world: &mut World) -> Self {
        let stages = ShaderStages::COMPUTE;
        let number_layout = BindGroupLayoutDescriptor::new(
            "contextual_ao_slice_number",
            &BindGroupLayoutEntries::single(stages, storage_buffer_read_only::<u32>(true)),
        );
        let shader: Handle<Shader> = load_embedded_asset!(world, "slices.wgsl");
        let pass = |is_multisampled: bool| {
            let depths = if is_multisampled { texture_depth_2d_multisampled() } else { texture_depth_2d() };
            let own = BindGroupLayoutEntries::sequential(
                stages,
                (
                    uniform_buffer::<WindowUniform>(false),
                    storage_buffer_read_only::<SlicingData>(false),
                    storage_buffer_sized(false, None),
                    texture_2d(TextureSampleType::Float { filterable: true }),
                    texture_storage_2d(LIGHT_FORMAT, StorageTextureAccess::WriteOnly),
                    depths,
                    storage_buffer_sized(false, None),
                ),
            );
            let descriptor = PassDescriptor {
                name: "contextual_ao_directional",
                shader: shader.clone(),
                shader_defs: ["LIT", "BY_GRADIENT"]
                    .into_iter()
                    .chain(is_multisampled.then_some("MULTISAMPLED"))
                    .map(Into::into)
                    .collect(),
                before: vec![lit_layout()],
                own: &own,
                behind: vec![number_layout.clone()],
                zeroes_memory: true,
                ..default()
            };
            ComputePass::new(world, descriptor)
        };
        Self { single: pass(false), multisampled: pass(true), number_layout }
    }
}

impl DirectionalPasses {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        are_ready([&self.single, &self.multisampled], cache)
    }

    fn pass(&self, is_multisampled: bool) -> &ComputePass {
        if is_multisampled { &self.multisampled } else { &self.single }
    }

    /// The bind groups of even and of odd slices.
    pub(super) fn bind_slices(
        &self,
        [window, slicing]: [BindingResource; 2],
        buffers: &Buffers,
        (depths, is_multisampled): (&TextureView, bool),
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> [BindGroup; 2] {
        let [a, b] = &buffers.light;
        [(a, b), (b, a)].map(|(before, behind)| {
            let eye = buffers.eye.as_entire_binding();
            let tile_states = buffers.tile_states.as_entire_binding();
            let resources =
                (window.clone(), slicing.clone(), eye, &before.view, &behind.view, depths, tile_states);
            self.pass(is_multisampled).bind(resources, cache, device)
        })
    }

    /// The bind group of the numbers of slices.
    pub(super) fn bind_numbers(
        &self,
        buffers: &Buffers,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> BindGroup {
        let number = BufferBinding { buffer: &buffers.numbers, offset: 0, size: BufferSize::new(4) };
        device.create_bind_group(
            "contextual_ao_slice_number",
            &cache.get_bind_group_layout(&self.number_layout),
            &BindGroupEntries::single(number),
        )
    }

    /// Encodes the pass over all slices, front to back.
    pub(super) fn encode(&self, encoder: &mut CommandEncoder, job: &SlicesJob, cache: &PipelineCache) {
        let Some(mut pass) = self.pass(job.is_multisampled).begin(encoder, cache) else {
            return;
        };
        pass.set_bind_group(0, &*job.volume, &[]);
        // A ring of background around the window.
        let groups = (job.pixels + 2 + 7) / 8;
        for slice in 0..job.count {
            pass.set_bind_group(1, &*job.slices[slice as usize % 2], &[]);
            pass.set_bind_group(2, &*job.number, &[slice * NUMBER_STRIDE]);
            pass.dispatch_workgroups(groups.x, groups.y, 1);
        }
    }
}
