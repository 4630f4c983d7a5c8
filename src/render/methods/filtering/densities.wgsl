// The densities of all voxels, before they are filtered.

#import bevy_contextual_ao::{
    bricks::{WIDTH, invocation_index},
    voxel_density::density_of,
    voxel_lines::{number_of_voxels, voxel_at},
}

@group(1) @binding(3) var<storage, read_write> densities: array<u32>;

@compute @workgroup_size(WIDTH)
fn find_densities(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let index = invocation_index(id, groups);
    if index < number_of_voxels() {
        densities[index] = density_of(voxel_at(index));
    }
}
