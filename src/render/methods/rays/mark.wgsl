// Marks the voxels that a view will read. Follows the view rays as drawing does, and asks for the stale
// occlusion of the voxels that they meet. Samples that opaque meshes will hide are not known yet, so that
// somewhat more is asked for than is read, never less.

#import bevy_contextual_ao::{
    bricks::{MASK_BLOCK, PENDING, VALID, mask_at, mask_of_box, mask_word},
    view_ray::{OPAQUE, Slice, begin_march, next_slice, view_ray},
    volume_bindings::{correct_opacity, volume},
    voxel_masks::voxel_masks,
    window::Window,
    work_list::{FRONT, append},
}

@group(1) @binding(0) var<uniform> window: Window;

// Margins for rounding: drawing may find slightly different opacities and places.
const OPACITY_MARGIN: f32 = 1e-3;
const PLACE_MARGIN: f32 = 1.0 / 256.0;
// Voxels of a mask word at even places along all axes.
const EVEN_VOXELS: u32 = 0x0505u;

@compute @workgroup_size(8, 8)
fn mark(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = window.first + id.xy;
    if any(pixel >= window.end) {
        return;
    }
    let place = vec2<f32>(pixel) + 0.5;
    let ray = view_ray(place, window.viewport, window.view_from_clip, window.world_from_view);
    var march = begin_march(ray);
    var alpha = 0.0;
    var before = vec3(-1);
    while alpha < OPAQUE + OPACITY_MARGIN {
        let slice = next_slice(ray, &march);
        if slice.steps <= 0.0 {
            break;
        }
        alpha += (1.0 - alpha) * correct_opacity(slice.sample.a, slice.steps * volume.draw_exponent);
        let point = slice.p * vec3<f32>(volume.dimensions) / f32(volume.occlusion_stride) - 0.5;
        let first = vec3<i32>(floor(point - PLACE_MARGIN));
        let last = vec3<i32>(floor(point + PLACE_MARGIN)) + 1;
        if any(first != before) || any(last != first + 1) {
            ask_for(first, last);
        }
        before = first;
    }
}

// Puts the stale texels of a box of the occlusion texture on the list. The list is of words of the voxel mask, in
// which voxels stand for texels.
fn ask_for(first: vec3<i32>, last: vec3<i32>) {
    let stride = volume.occlusion_stride;
    let limit = (vec3<i32>(volume.dimensions) - 1) / i32(stride);
    let low = stride * vec3<u32>(clamp(first, vec3(0), limit));
    let high = stride * vec3<u32>(clamp(last, vec3(0), limit));
    let standing = select(EVEN_VOXELS, 0xffffffffu, stride == 1u);
    let first_block = low / MASK_BLOCK;
    let last_block = high / MASK_BLOCK;
    for (var z = first_block.z; z <= last_block.z; z += 1u) {
        for (var y = first_block.y; y <= last_block.y; y += 1u) {
            for (var x = first_block.x; x <= last_block.x; x += 1u) {
                let block = vec3(x, y, z);
                let word = mask_word(block * MASK_BLOCK);
                let voxels = mask_of_box(block, low, high) & standing;
                let valid = &voxel_masks[mask_at(VALID, word)];
                // Reading is cheap, and almost all voxels have been asked for.
                let stale = voxels & ~atomicLoad(valid);
                if stale != 0u {
                    let pending = &voxel_masks[mask_at(PENDING, word)];
                    let first_asked = stale & ~atomicOr(valid, stale);
                    if first_asked != 0u && atomicOr(pending, first_asked) == 0u {
                        append(FRONT, word);
                    }
                }
            }
        }
    }
}
