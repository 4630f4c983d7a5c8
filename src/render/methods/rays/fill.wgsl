// Gives texels without valid occlusion the factor of an open flat surface: what waits for its rays is drawn as if
// unoccluded.

#import bevy_contextual_ao::{
    bricks::{PENDING, VALID, mask_at, mask_bit, mask_word},
    volume_bindings::volume,
}

@group(1) @binding(0) var<uniform> flat_factor: f32;
@group(1) @binding(1) var<storage, read> voxel_masks: array<u32>;
#ifdef STORE_R8
@group(1) @binding(2) var occlusion: texture_storage_3d<r8unorm, write>;
#else
@group(1) @binding(2) var occlusion: texture_storage_3d<rgba8unorm, write>;
#endif

@compute @workgroup_size(4, 4, 4)
fn fill(@builtin(global_invocation_id) texel: vec3<u32>) {
    let voxel = volume.occlusion_stride * texel;
    if any(voxel >= volume.dimensions) {
        return;
    }
    let word = mask_word(voxel);
    // A voxel that is to be cast counts as valid already.
    let known = voxel_masks[mask_at(VALID, word)] & ~voxel_masks[mask_at(PENDING, word)];
    if (known & mask_bit(voxel)) == 0u {
        textureStore(occlusion, texel, vec4(flat_factor, 0.0, 0.0, 0.0));
    }
}
