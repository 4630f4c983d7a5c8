//! The bricks of 4x4x4 voxels in which passes visit a volume (`occlusion_pass.wgsl`).

use bevy::{
    prelude::*,
    render::render_resource::{BindGroup, CommandEncoder, ComputePassDescriptor, ComputePipeline},
};

/// Voxels along each side of a brick: one workgroup.
const BRICK: u32 = 4;
/// Most workgroups along one dimension of a dispatch (the WebGPU limit).
const MOST_GROUPS: u32 = 65_535;

/// Number of voxels in a brick.
pub(crate) const VOXELS_PER_BRICK: u64 = (BRICK * BRICK * BRICK) as u64;

/// Number of bricks of a volume, those at its edges counted whole.
pub(crate) fn brick_count(dimensions: UVec3) -> u32 {
    let bricks = (dimensions + (BRICK - 1)) / BRICK;
    bricks.element_product()
}

/// Dispatches one workgroup per brick.
pub(crate) fn dispatch_bricks(
    encoder: &mut CommandEncoder,
    label: &'static str,
    pipeline: &ComputePipeline,
    groups: [&BindGroup; 2],
    bricks: u32,
) {
    let mut pass =
        encoder.begin_compute_pass(&ComputePassDescriptor { label: Some(label), timestamp_writes: None });
    pass.set_pipeline(pipeline);
    for (index, group) in (0..).zip(groups) {
        pass.set_bind_group(index, group, &[]);
    }
    let rows = bricks.div_ceil(MOST_GROUPS).max(1);
    pass.dispatch_workgroups(bricks.div_ceil(rows), rows, 1);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bricks_cover_edges() {
        assert_eq!(brick_count(UVec3::new(1, 4, 5)), 2);
        assert_eq!(brick_count(UVec3::splat(512)), 128 * 128 * 128);
    }
}
