// Uniformly occluded voxels become transparent. The drawn share of a voxel's opacity follows from the gradient of its
// occlusion (Ruiz et al., section 4.2). The gradient is a linear regression over the 26 voxels around the voxel
// (Neumann et al. 2000: Gradient estimation in volume data using 4D linear regression). Each of them is weighted by the
// reciprocal of its distance. Beyond the grid occlusion is that of the nearest voxel.

#import bevy_contextual_ao::{
    bricks::{WIDTH, invocation_index},
    voxel_lines::{filtering, number_of_voxels, strides, voxel_at},
}

@group(1) @binding(3) var<storage, read> shares: array<f32>;
@group(1) @binding(4) var occlusion: texture_storage_3d<rgba8unorm, write>;

// Sum of the weights of all neighbours outside the voxel's own plane: 2 + 8 / sqrt(2) + 8 / sqrt(3).
const WEIGHTS: f32 = 12.275656;

@compute @workgroup_size(WIDTH)
fn modulate(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let index = invocation_index(id, groups);
    if index >= number_of_voxels() {
        return;
    }
    let voxel = voxel_at(index);
    let last = vec3<i32>(filtering.dimensions) - 1;
    var gradient = vec3(0.0);
    for (var k = 0; k < 27; k += 1) {
        let offset = vec3(k % 3, (k / 3) % 3, k / 9) - 1;
        let neighbor = vec3<u32>(clamp(vec3<i32>(voxel) + offset, vec3(0), last));
        let places = neighbor * strides();
        let share = shares[places.x + places.y + places.z];
        // The voxel itself does not contribute.
        gradient += share * vec3<f32>(offset) / max(length(vec3<f32>(offset)), 1.0);
    }
    let steepness = length(gradient) / WEIGHTS;
    var drawn = 1.0;
    if steepness < filtering.threshold {
        drawn = steepness / filtering.threshold;
    }
    textureStore(occlusion, voxel, vec4(saturate(filtering.brightness * shares[index]), drawn, 0.0, 0.0));
}
