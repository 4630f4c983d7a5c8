//! Compute passes: their pipelines, bind groups and dispatches.

use bevy::{
    prelude::*,
    render::{
        render_resource::{
            self, BindGroup, BindGroupEntries, BindGroupEntry, BindGroupLayoutDescriptor,
            BindGroupLayoutEntry, Buffer, CachedComputePipelineId, CommandEncoder, ComputePassDescriptor,
            ComputePipeline, ComputePipelineDescriptor, IntoBindingArray, PipelineCache,
        },
        renderer::RenderDevice,
    },
    shader::ShaderDefVal,
};
use std::sync::OnceLock;

use super::formats::Formats;

/// Voxels along each side of a brick (`bricks.wgsl`).
const BRICK: u32 = 4;
/// Bricks along each side of a superbrick (`superbricks.wgsl`).
const SUPERBRICK: u32 = 4;
/// Number of invocations of a workgroup in [`Groups::Invocations`].
pub(crate) const WIDTH: u32 = 64;
/// Number of words in the head of a list's end. The arguments of the dispatch come first (`work_list.wgsl`).
pub(crate) const LIST_HEAD: u32 = 4;
/// Largest number of workgroups along one dimension of a dispatch (the WebGPU limit).
const MAX_GROUPS: u32 = 65_535;

/// Number of bricks of a volume along each axis, including incomplete bricks at the edges.
pub(crate) fn brick_counts(dimensions: UVec3) -> UVec3 {
    (dimensions + (BRICK - 1)) / BRICK
}

/// Number of superbricks of a volume along each axis, including incomplete superbricks at the edges.
pub(crate) fn superbrick_counts(dimensions: UVec3) -> UVec3 {
    (brick_counts(dimensions) + (SUPERBRICK - 1)) / SUPERBRICK
}

/// One compute pass, and the layout of its own bind group.
pub struct ComputePass {
    name: &'static str,
    layout: BindGroupLayoutDescriptor,
    descriptor: ComputePipelineDescriptor,
    /// Queued at the first request.
    pipeline: OnceLock<CachedComputePipelineId>,
}

/// Description of a compute pass.
#[derive(Default)]
pub struct PassDescriptor<'a> {
    /// Label of the pass and of everything that belongs to it.
    pub name: &'static str,
    /// Shader of the pass.
    pub shader: Handle<Shader>,
    /// Entry point of the shader. `None`: the shader's only entry point.
    pub entry_point: Option<&'static str>,
    /// Definitions besides those of all passes. All passes have `VOLUME_BIND_GROUP` and
    /// `RUNS_BIND_GROUP`. `STORE_R8` is set if the device
    /// can write textures of one byte a texel. `GRID_BORDER` is set if samples outside a grid are transparent.
    pub shader_defs: Vec<ShaderDefVal>,
    /// Layouts of the groups before the pass's own group.
    pub before: Vec<BindGroupLayoutDescriptor>,
    /// Layout of the pass's own group.
    pub own: &'a [BindGroupLayoutEntry],
    /// Layouts of the groups behind the pass's own group.
    pub behind: Vec<BindGroupLayoutDescriptor>,
    /// Whether the shader relies on workgroup memory being 0 at first.
    pub zeroes_memory: bool,
}

impl ComputePass {
    /// Describes a pass. Nothing is compiled yet.
    pub fn new(world: &World, descriptor: PassDescriptor) -> Self {
        let layout = BindGroupLayoutDescriptor::new(descriptor.name, descriptor.own);
        let mut layouts = descriptor.before;
        layouts.push(layout.clone());
        layouts.extend(descriptor.behind);
        let mut shader_defs = world.resource::<Formats>().shader_defs();
        shader_defs.extend(descriptor.shader_defs);
        let name = descriptor.name;
        let descriptor = ComputePipelineDescriptor {
            label: Some(name.into()),
            layout: layouts,
            shader: descriptor.shader,
            shader_defs,
            entry_point: descriptor.entry_point.map(Into::into),
            zero_initialize_workgroup_memory: descriptor.zeroes_memory,
            ..default()
        };
        Self { name, layout, descriptor, pipeline: default() }
    }

    /// Whether the pipeline is compiled. The first call starts its compilation.
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        self.pipeline(cache).is_some()
    }

    fn pipeline<'c>(&self, cache: &'c PipelineCache) -> Option<&'c ComputePipeline> {
        let queue = || cache.queue_compute_pipeline(self.descriptor.clone());
        cache.get_compute_pipeline(*self.pipeline.get_or_init(queue))
    }

    /// Layout of the pass's own bind group, for other passes to share.
    pub fn layout(&self) -> &BindGroupLayoutDescriptor {
        &self.layout
    }

    /// Makes the pass's own bind group from resources in the order of their bindings.
    pub fn bind<'b, const N: usize>(
        &self,
        resources: impl IntoBindingArray<'b, N>,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> BindGroup {
        self.bind_entries(&BindGroupEntries::sequential(resources), cache, device)
    }

    /// Makes the same bind group from entries with their bindings.
    pub fn bind_entries(
        &self,
        entries: &[BindGroupEntry],
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> BindGroup {
        device.create_bind_group(self.name, &cache.get_bind_group_layout(&self.layout), entries)
    }

    /// Begins the pass, to be bound and dispatched. `None` until its pipeline is compiled.
    pub fn begin<'e>(
        &self,
        encoder: &'e mut CommandEncoder,
        cache: &PipelineCache,
    ) -> Option<render_resource::ComputePass<'e>> {
        let pipeline = self.pipeline(cache)?;
        let descriptor = ComputePassDescriptor { label: Some(self.name), timestamp_writes: None };
        let mut pass = encoder.begin_compute_pass(&descriptor);
        pass.set_pipeline(pipeline);
        Some(pass)
    }

    /// Encodes one dispatch of the pass, with all its bind groups.
    pub fn encode<'b>(
        &self,
        encoder: &mut CommandEncoder,
        bind_groups: impl IntoIterator<Item = &'b BindGroup>,
        groups: Groups,
        cache: &PipelineCache,
    ) {
        let Some(mut pass) = self.begin(encoder, cache) else {
            return;
        };
        for (index, group) in (0..).zip(bind_groups) {
            pass.set_bind_group(index, group, &[]);
        }
        match groups {
            Groups::Square(side) => pass.dispatch_workgroups(side, side, 1),
            Groups::Pixels(size) => pass.dispatch_workgroups(size.x.div_ceil(8), size.y.div_ceil(8), 1),
            Groups::Voxels(size) => {
                let groups = brick_counts(size);
                pass.dispatch_workgroups(groups.x, groups.y, groups.z);
            }
            Groups::Invocations(count) => {
                let groups = count.div_ceil(WIDTH);
                let rows = groups.div_ceil(MAX_GROUPS).max(1);
                pass.dispatch_workgroups(groups.div_ceil(rows), rows, 1);
            }
            Groups::Listed(list, end) => {
                pass.dispatch_workgroups_indirect(list, 4 * (LIST_HEAD * end as u32) as u64)
            }
        }
    }

    /// Encodes many dispatches of the pass. Each step has an offset into the uniforms of the second bind group, and its
    /// numbers of workgroups. Each dispatch sees the writes of the one before.
    pub fn encode_steps(
        &self,
        encoder: &mut CommandEncoder,
        [first, second]: [&BindGroup; 2],
        steps: impl IntoIterator<Item = (u32, UVec2)>,
        cache: &PipelineCache,
    ) {
        let Some(pipeline) = self.pipeline(cache) else {
            return;
        };
        let mut pass = encoder
            .begin_compute_pass(&ComputePassDescriptor { label: Some(self.name), timestamp_writes: None });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, first, &[]);
        for (offset, groups) in steps {
            pass.set_bind_group(1, second, &[offset]);
            pass.dispatch_workgroups(groups.x, groups.y, 1);
        }
    }
}

/// Whether the pipelines of all passes are compiled. The first call requests all of them at once.
pub(crate) fn are_ready<'p>(
    passes: impl IntoIterator<Item = &'p ComputePass>,
    cache: &PipelineCache,
) -> bool {
    passes.into_iter().filter(|pass| !pass.is_ready(cache)).count() == 0
}

/// Numbers of workgroups of a dispatch.
#[derive(Clone, Copy)]
pub enum Groups<'a> {
    /// This many columns and rows of workgroups.
    Square(u32),
    /// One invocation for each pixel, 8x8 to a workgroup.
    Pixels(UVec2),
    /// One invocation for each voxel, a brick to a workgroup.
    Voxels(UVec3),
    /// This many invocations, 64 to a workgroup. More than 65,535 workgroups form several rows.
    Invocations(u32),
    /// The numbers in the head of a list's end (`work_list.wgsl`).
    Listed(&'a Buffer, ListEnd),
}

/// One end of a list, as `FRONT` and `BACK` in WGSL.
#[derive(Clone, Copy)]
pub enum ListEnd {
    /// Items from the beginning.
    Front,
    /// Items appended from the end.
    Back,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bricks_cover_edges() {
        assert_eq!(brick_counts(UVec3::new(1, 4, 5)), UVec3::new(1, 1, 2));
        assert_eq!(brick_counts(UVec3::splat(512)), UVec3::splat(128));
    }
}
