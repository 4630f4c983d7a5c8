// Step IV of the CAO paper (section 3.5, algorithm 2), in the bricks that `cull` lists to be clipped. Finds the opacity
// of every voxel after clipping, and whether a drawn point can read the voxel. Its occlusion is stale if a changed
// carver affects it, in its past or its present state.
//
// There are two differences from algorithm 2. A voxel is tested for being affected only at its centre, because the
// dilation maps contain the voxel's footprint. A voxel counts as hidden only if one carver removes all of that
// footprint, not if 9 samples are removed. Between samples, an intersecting carver, or the gap between two carvers, may
// show points that read the voxel.

#import bevy_contextual_ao::{
    bricks::{HIDDEN, PENDING, VALID, brick_at, mask_at, mask_bit},
    changes::is_stale,
    coverage::{clip_voxel, local_position},
    emptiness::{is_brick_transparent, is_range_transparent},
    listed::{NOTHING, listed_item},
    clip_pass::{QUEUE_ALL, QUEUE_NONE, QUEUE_SAMPLEABLE, clip_pass},
    volume_bindings::{classify_intensity, correct_opacity, intensities, volume},
    voxel_masks::voxel_masks,
    work_list::{FRONT, append},
}

@group(1) @binding(6) var<storage, read> near_carvers: array<u32>;
#ifdef STORE_R8
@group(1) @binding(5) var opacities: texture_storage_3d<r8unorm, write>;
#else
@group(1) @binding(5) var opacities: texture_storage_3d<rgba8unorm, write>;
#endif

// Results for the brick's voxels, as masks.
var<workgroup> hidden: array<atomic<u32>, 2>;
var<workgroup> stale: array<atomic<u32>, 2>;
var<workgroup> queued: array<atomic<u32>, 2>;

@compute @workgroup_size(4, 4, 4)
fn clip(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let brick = listed_item(FRONT, group);
    if brick == NOTHING {
        return;
    }
    let place = brick_at(brick);
    let voxel = 4u * place + local;
    let word = local.z >> 1u;
    let bit = mask_bit(local);
    if any(voxel >= volume.dimensions) {
        atomicOr(&hidden[word], bit);
    } else {
        let is_old = is_stale(local_position(vec3<f32>(voxel)));
        atomicOr(&stale[word], select(0u, bit, is_old));
        let intensity = textureLoad(intensities, voxel, 0).r;
        let opacity = correct_opacity(classify_intensity(intensity).a, volume.occlusion_exponent);
        let near = near_carvers[brick] | volume.tests_all_carvers;
        let clipping = clip_voxel(vec3<f32>(voxel), near, opacity > 0.0);
        textureStore(opacities, voxel, vec4(opacity * clipping.coverage, 0.0, 0.0, 0.0));
        let is_hidden = clipping.is_removed || is_brick_transparent(brick);
        atomicOr(&hidden[word], select(0u, bit, is_hidden));
        if is_old && is_wanted(voxel, clipping.is_removed) {
            atomicOr(&queued[word], bit);
        }
    }
    workgroupBarrier();
    if lane < 2u {
        let word = 2u * brick + lane;
        atomicStore(&voxel_masks[mask_at(HIDDEN, word)], atomicLoad(&hidden[lane]));
        let valid = &voxel_masks[mask_at(VALID, word)];
        let to_cast = atomicLoad(&queued[lane]);
        atomicStore(valid, (atomicLoad(valid) & ~atomicLoad(&stale[lane])) | to_cast);
        if to_cast != 0u {
            atomicStore(&voxel_masks[mask_at(PENDING, word)], to_cast);
            append(FRONT, word);
        }
    }
}

// Whether a stale voxel is to be cast although no view asked for it.
fn is_wanted(voxel: vec3<u32>, is_removed: bool) -> bool {
    let stride = volume.occlusion_stride;
    if any(voxel % stride != vec3(0u)) {
        return false;
    }
    // Where 2x2x2 voxels have one factor, others may be visible although this voxel is not.
    if stride > 1u {
        return clip_pass.queue != QUEUE_NONE;
    }
    switch clip_pass.queue {
        case QUEUE_NONE: { return false; }
        case QUEUE_ALL: { return true; }
        case QUEUE_SAMPLEABLE: { return !is_removed && is_sampleable(voxel); }
        default: { return !is_removed; }
    }
}

// Whether anything in the cells around a voxel can be visible.
fn is_sampleable(voxel: vec3<u32>) -> bool {
    let last = vec3<i32>(volume.dimensions) - 1;
    var lowest = 1.0;
    var highest = 0.0;
    for (var k = 0; k < 27; k += 1) {
        let neighbor = vec3<i32>(voxel) + vec3(k % 3, (k / 3) % 3, k / 9) - 1;
        let intensity = textureLoad(intensities, clamp(neighbor, vec3(0), last), 0).r;
        lowest = min(lowest, intensity);
        highest = max(highest, intensity);
    }
    return !is_range_transparent(lowest, highest);
}
