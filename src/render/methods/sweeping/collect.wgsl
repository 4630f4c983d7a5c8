// Writes the results of the sweeps to the occlusion texture. This is the octants' mean, with the paper's gamma (Singh,
// Yuksel, House 2009, section 3), or each octant's visibility. Drawing weights octants by the normal.

#import bevy_contextual_ao::{
    sweeping::sweeping,
    volume_bindings::{volume, voxel_index},
}

@group(1) @binding(5) var<storage, read> found: array<u32>;
#ifdef OCTANTS
@group(1) @binding(7) var occlusion: texture_storage_3d<rgba8unorm, write>;
#else ifdef STORE_R8
@group(1) @binding(7) var occlusion: texture_storage_3d<r8unorm, write>;
#else
@group(1) @binding(7) var occlusion: texture_storage_3d<rgba8unorm, write>;
#endif

@compute @workgroup_size(4, 4, 4)
fn collect(@builtin(global_invocation_id) voxel: vec3<u32>) {
    if any(voxel >= volume.dimensions) {
        return;
    }
    let index = voxel_index(voxel);
#ifdef OCTANTS
    textureStore(occlusion, voxel, unpack4x8unorm(found[2u * index]));
    let behind = vec3(voxel.xy, voxel.z + volume.dimensions.z);
    textureStore(occlusion, behind, unpack4x8unorm(found[2u * index + 1u]));
#else
    let mean = saturate(bitcast<f32>(found[index]));
    let factor = select(0.0, pow(mean, sweeping.power), mean > 0.0);
    textureStore(occlusion, voxel, vec4(factor, 0.0, 0.0, 0.0));
#endif
}
