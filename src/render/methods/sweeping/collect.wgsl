// Writes the results of the sweeps to the occlusion texture. This is the octants' mean, with the paper's gamma (Singh,
// Yuksel, House 2009, section 3), or each octant's visibility. Drawing weights octants by the normal. From a turned grid
// (section 4.1) voxels get the light between its cells. It is that of octant 7.

#import bevy_contextual_ao::{
    sweeping::{corner_of, sweeping},
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

#ifdef TURNED
fn mean_light(voxel: vec3<u32>) -> f32 {
    let place = (sweeping.cell_from_voxel * vec4(vec3<f32>(voxel), 1.0)).xyz;
    var light = 0.0;
    for (var k = 0u; k < 8u; k += 1u) {
        let corner = corner_of(place, sweeping.cells, k);
        light += corner.weight * bitcast<f32>(found[corner.index]);
    }
    return saturate(light);
}
#else
fn mean_light(voxel: vec3<u32>) -> f32 {
    return saturate(bitcast<f32>(found[voxel_index(voxel)]));
}
#endif

@compute @workgroup_size(4, 4, 4)
fn collect(@builtin(global_invocation_id) voxel: vec3<u32>) {
    if any(voxel >= volume.dimensions) {
        return;
    }
#ifdef OCTANTS
    let behind = vec3(voxel.xy, voxel.z + volume.dimensions.z);
#ifdef TURNED
    textureStore(occlusion, voxel, vec4(0.0));
    textureStore(occlusion, behind, vec4(0.0, 0.0, 0.0, mean_light(voxel)));
#else
    let index = voxel_index(voxel);
    textureStore(occlusion, voxel, unpack4x8unorm(found[2u * index]));
    textureStore(occlusion, behind, unpack4x8unorm(found[2u * index + 1u]));
#endif
#else
    let mean = mean_light(voxel);
    let factor = select(0.0, pow(mean, sweeping.power), mean > 0.0);
    textureStore(occlusion, voxel, vec4(factor, 0.0, 0.0, 0.0));
#endif
}
