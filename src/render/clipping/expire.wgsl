// Step IV of the CAO paper (section 3.5) in the listed bricks in which changed carvers clip nothing. The occlusion of
// voxels within reach of a carver's past or present state becomes stale.

#import bevy_contextual_ao::{
    bricks::{VALID, brick_at, mask_at, mask_bit},
    changes::is_stale,
    coverage::local_position,
    listed::{NOTHING, listed_item},
    volume_bindings::volume,
    voxel_masks::voxel_masks,
    work_list::BACK,
}

// Stale voxels of the brick, as a mask.
var<workgroup> stale: array<atomic<u32>, 2>;

@compute @workgroup_size(4, 4, 4)
fn expire(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let brick = listed_item(BACK, group);
    if brick == NOTHING {
        return;
    }
    // Bits beyond the grid's edge are harmless.
    let voxel = 4u * brick_at(brick) + local;
    atomicOr(&stale[local.z >> 1u], select(0u, mask_bit(local), is_stale(local_position(vec3<f32>(voxel)))));
    workgroupBarrier();
    if lane < 2u {
        let valid = &voxel_masks[mask_at(VALID, 2u * brick + lane)];
        atomicStore(valid, atomicLoad(valid) & ~atomicLoad(&stale[lane]));
    }
}
