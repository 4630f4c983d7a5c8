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
    classification::OCCLUSIONS,
    coverage::{clip_voxel, local_position},
    emptiness::{is_brick_transparent, is_range_transparent},
    gradients::gradient_length,
    listed::{NOTHING, listed_item},
    clip_pass::{QUEUE_ALL, QUEUE_NONE, QUEUE_SAMPLEABLE, clip_pass},
    preintegration::{mean_between, table_place},
    volume_bindings::{intensities, volume},
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
        let opacity = opacity_of_voxel(voxel);
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

fn intensity_of(voxel: vec3<i32>) -> f32 {
    return textureLoad(intensities, clamp(voxel, vec3(0), vec3<i32>(volume.dimensions) - 1), 0).r;
}

// Opacity of an occlusion step in a voxel: the mean over the intensities in the voxel. A linear change of intensity
// spreads them over half the gradient's length to either side, as an even distribution of the same variance. They stay
// between the intensities of the neighbours. The published opacity is that of the voxel's own intensity.
fn opacity_of_voxel(voxel: vec3<u32>) -> f32 {
    let place = vec3<i32>(voxel);
    let own = intensity_of(place);
    var gradient = vec3(0.0);
    var lowest = own;
    var highest = own;
    for (var axis = 0; axis < 3; axis += 1) {
        let step = vec3<i32>(vec3(axis) == vec3(0, 1, 2));
        let before = intensity_of(place - step);
        let behind = intensity_of(place + step);
        gradient += 0.5 * (behind - before) * vec3<f32>(step);
        lowest = min(lowest, min(before, behind));
        highest = max(highest, max(before, behind));
    }
    let half = 0.5 * length(gradient) * volume.footprint_share;
    let steepness = gradient_length(gradient);
    let low = table_place(max(own - half, lowest), OCCLUSIONS, steepness);
    let high = table_place(min(own + half, highest), OCCLUSIONS, steepness);
    return saturate(mean_between(low, high));
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

// Whether drawing can read a voxel's occlusion. A point that does so is up to 1.5 voxels away. A tricubic intensity there
// reads two voxels farther on, and a slice is shaded up to a voxel from its ends.
fn is_sampleable(voxel: vec3<u32>) -> bool {
    var lowest = 1.0;
    var highest = 0.0;
    let decides = i32(volume.deciding_voxels);
    let side = 2 * decides + 1;
    for (var k = 0; k < side * side * side; k += 1) {
        let offset = vec3(k % side, (k / side) % side, k / (side * side)) - decides;
        let intensity = intensity_of(vec3<i32>(voxel) + offset);
        lowest = min(lowest, intensity);
        highest = max(highest, intensity);
    }
    // Longer slices are shaded farther from their ends.
    return !is_range_transparent(lowest, highest) || volume.draw_step_mm > volume.voxel_mm;
}
