//! How passes over bricks and lists are dispatched.

use bevy::{
    prelude::*,
    render::render_resource::{BindGroup, Buffer, CommandEncoder, ComputePassDescriptor, ComputePipeline},
};

/// Voxels along each side of a brick (`bricks.wgsl`).
const BRICK: u32 = 4;
/// Invocations of a workgroup that takes a brick each.
const WIDTH: u32 = 64;
/// Most workgroups along one dimension of a dispatch (the WebGPU limit).
const MOST_GROUPS: u32 = 65_535;

/// Number of bricks of a volume along each axis, those at its edges counted whole.
pub(crate) fn brick_counts(dimensions: UVec3) -> UVec3 {
    (dimensions + (BRICK - 1)) / BRICK
}

/// How many workgroups a pass gets.
#[derive(Clone, Copy)]
pub(crate) enum Groups<'a> {
    /// One invocation for so many bricks.
    Bricks(u32),
    /// Columns and rows.
    Pixels(UVec2),
    /// As the head of a [`WorkList`](super::work_list::WorkList) says.
    Listed(&'a Buffer),
}

/// One compute pass.
pub(crate) fn dispatch<const N: usize>(
    encoder: &mut CommandEncoder,
    label: &'static str,
    pipeline: &ComputePipeline,
    bind_groups: [&BindGroup; N],
    groups: Groups,
) {
    let mut pass =
        encoder.begin_compute_pass(&ComputePassDescriptor { label: Some(label), timestamp_writes: None });
    pass.set_pipeline(pipeline);
    for (index, group) in (0..).zip(bind_groups) {
        pass.set_bind_group(index, group, &[]);
    }
    match groups {
        Groups::Bricks(bricks) => {
            let groups = bricks.div_ceil(WIDTH);
            let rows = groups.div_ceil(MOST_GROUPS).max(1);
            pass.dispatch_workgroups(groups.div_ceil(rows), rows, 1);
        }
        Groups::Pixels(size) => pass.dispatch_workgroups(size.x.div_ceil(8), size.y.div_ceil(8), 1),
        Groups::Listed(list) => pass.dispatch_workgroups_indirect(list, 0),
    }
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
