// Lists the words of voxels whose progressive rays go on, unless this frame has listed them already because it touched
// some of their voxels. One invocation for each word of the mask.

#import bevy_contextual_ao::{
    bricks::{PENDING, invocation_index, mask_at, number_of_bricks},
    running_mean::progress_of,
    voxel_masks::voxel_masks,
    work_list::{FRONT, append},
}

@compute @workgroup_size(64)
fn go_on(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let word = invocation_index(id, groups);
    if word >= 2u * number_of_bricks() {
        return;
    }
    if progress_of(word).going != 0u && atomicLoad(&voxel_masks[mask_at(PENDING, word)]) == 0u {
        append(FRONT, word);
    }
}
