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
    buffers::{Buffers, LIGHT_FORMAT, NUMBER_STRIDE, tile_counts},
    slicing::SlicingData,
};
use crate::render::{
    gpu::compute_pass::{ComputePass, PassDescriptor, are_ready},
    volumes::layouts::lit_layout,
    windows::WindowUniform,
};

/// Tiles for each workgroup. Fewer keep a wide GPU busier; more are faster on a processor, to which workgroups are dear.
const TILES_PER_GROUP: u32 = 8;
/// Bounds of the number of workgroups.
const FEWEST_GROUPS: u32 = 32;
const MOST_GROUPS: u32 = 8192;

/// The passes over slices, by their variants.
#[derive(Resource)]
pub(crate) struct DirectionalPasses {
    passes: [ComputePass; SlicesVariant::COUNT],
    /// Layout of the number of a slice.
    number_layout: BindGroupLayoutDescriptor,
}

/// What tells the pipelines apart. A pipeline that is lit and follows the gradient draws any volume. Others leave out
/// many reads of neighbouring voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SlicesVariant {
    /// Whether the view has several samples a pixel.
    pub is_multisampled: bool,
    pub is_lit: bool,
    /// Whether the transfer function follows the gradient.
    pub by_gradient: bool,
}

impl SlicesVariant {
    const COUNT: usize = 8;

    fn all() -> [Self; Self::COUNT] {
        let bit = |index: usize, bit: u32| index >> bit & 1 == 1;
        core::array::from_fn(|index| Self {
            is_multisampled: bit(index, 0),
            is_lit: bit(index, 1),
            by_gradient: bit(index, 2),
        })
    }

    fn index(self) -> usize {
        usize::from(self.is_multisampled) + 2 * usize::from(self.is_lit) + 4 * usize::from(self.by_gradient)
    }

    /// The variant that draws any volume in the same views.
    fn of_any_volume(self) -> Self {
        Self { is_lit: true, by_gradient: true, ..self }
    }

    fn shader_defs(self) -> impl Iterator<Item = &'static str> {
        let multisampled = self.is_multisampled.then_some("MULTISAMPLED");
        let lit = self.is_lit.then_some("LIT");
        let by_gradient = self.by_gradient.then_some("BY_GRADIENT");
        [multisampled, lit, by_gradient].into_iter().flatten()
    }
}

/// The slices of one volume in one view.
pub(super) struct SlicesJob {
    pub volume: BindGroup,
    /// Bind groups of even and of odd slices.
    pub slices: [BindGroup; 2],
    pub number: BindGroup,
    pub count: u32,
    pub pixels: UVec2,
    pub variant: SlicesVariant,
}

impl FromWorld for DirectionalPasses {
    fn from_world(world: &mut World) -> Self {
        let stages = ShaderStages::COMPUTE;
        let number_layout = BindGroupLayoutDescriptor::new(
            "contextual_ao_slice_number",
            &BindGroupLayoutEntries::single(stages, storage_buffer_read_only::<u32>(true)),
        );
        let shader: Handle<Shader> = load_embedded_asset!(world, "slices.wgsl");
        let pass = |variant: SlicesVariant| {
            let depths = match variant.is_multisampled {
                true => texture_depth_2d_multisampled(),
                false => texture_depth_2d(),
            };
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
                shader_defs: variant.shader_defs().map(Into::into).collect(),
                before: vec![lit_layout()],
                own: &own,
                behind: vec![number_layout.clone()],
                ..default()
            };
            ComputePass::new(world, descriptor)
        };
        Self { passes: SlicesVariant::all().map(pass), number_layout }
    }
}

impl DirectionalPasses {
    /// Whether any volume can be drawn.
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        let of_any = SlicesVariant::all().into_iter().filter(|variant| *variant == variant.of_any_volume());
        are_ready(of_any.map(|variant| &self.passes[variant.index()]), cache)
    }

    /// The pass of a variant, or until its pipeline is ready that of any volume.
    fn pass(&self, variant: SlicesVariant, cache: &PipelineCache) -> &ComputePass {
        let own = &self.passes[variant.index()];
        if own.is_ready(cache) { own } else { &self.passes[variant.of_any_volume().index()] }
    }

    /// The bind groups of even and of odd slices.
    pub(super) fn bind_slices(
        &self,
        [window, slicing]: [BindingResource; 2],
        buffers: &Buffers,
        depths: &TextureView,
        variant: SlicesVariant,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> [BindGroup; 2] {
        let [a, b] = &buffers.light;
        [(a, b), (b, a)].map(|(before, behind)| {
            let eye = buffers.eye.as_entire_binding();
            let tile_states = buffers.tile_states.as_entire_binding();
            let resources =
                (window.clone(), slicing.clone(), eye, &before.view, &behind.view, depths, tile_states);
            self.passes[variant.index()].bind(resources, cache, device)
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
        let Some(mut pass) = self.pass(job.variant, cache).begin(encoder, cache) else {
            return;
        };
        pass.set_bind_group(0, &*job.volume, &[]);
        let tiles = tile_counts(job.pixels).element_product();
        let groups = (tiles / TILES_PER_GROUP).clamp(FEWEST_GROUPS, MOST_GROUPS);
        for slice in 0..job.count {
            pass.set_bind_group(1, &*job.slices[slice as usize % 2], &[]);
            pass.set_bind_group(2, &*job.number, &[slice * NUMBER_STRIDE]);
            pass.dispatch_workgroups(groups, 1, 1);
        }
    }
}
