// Openness of voxels: the mean transparency of the six neighbours at a distance. Everything outside of the grid is
// transparent.

#import bevy_contextual_ao::volume_bindings::volume

@group(1) @binding(0) var opacities: texture_3d<f32>;
@group(1) @binding(1) var<uniform> distance_voxels: i32;
#ifdef STORE_R8
@group(1) @binding(2) var occlusion: texture_storage_3d<r8unorm, write>;
#else
@group(1) @binding(2) var occlusion: texture_storage_3d<rgba8unorm, write>;
#endif

fn transparency(voxel: vec3<i32>) -> f32 {
    let is_inside = all(voxel >= vec3(0)) && all(voxel < vec3<i32>(volume.dimensions));
    return 1.0 - select(0.0, textureLoad(opacities, voxel, 0).r, is_inside);
}

@compute @workgroup_size(4, 4, 4)
fn find_openness(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id >= volume.dimensions) {
        return;
    }
    let voxel = vec3<i32>(id);
    var sum = 0.0;
    for (var axis = 0; axis < 3; axis += 1) {
        var step = vec3(0);
        step[axis] = distance_voxels;
        sum += transparency(voxel - step) + transparency(voxel + step);
    }
    textureStore(occlusion, voxel, vec4(sum / 6.0));
}
