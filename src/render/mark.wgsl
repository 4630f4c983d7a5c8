// Which voxels a view will read: follows the view rays as drawing does, and asks for the occlusion of
// what they meet where it is not up to date. What is drawn later behind opaque meshes is not known
// yet, so somewhat more is asked for than is read; never less.

#import bevy_contextual_ao::{
    bricks::{PENDING, VALID, mask_at, mask_bit, mask_word},
    view_ray::{OPAQUE, Slice, begin_march, next_slice, view_ray},
    volume_bindings::{correct_opacity, volume},
    voxel_masks::voxel_masks,
    work_list::append,
}

struct Window {
    view_from_clip: mat4x4<f32>,
    world_from_view: mat4x4<f32>,
    // Origin and size, pixels.
    viewport: vec4<f32>,
    // Pixels in which the volume may be seen.
    first: vec2<u32>,
    end: vec2<u32>,
}

@group(1) @binding(0) var<uniform> window: Window;

// Drawing may find opacities and places that differ from these by rounding.
const OPACITY_MARGIN: f32 = 1e-3;
const PLACE_MARGIN: f32 = 1.0 / 256.0;

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
        let point = slice.p * vec3<f32>(volume.dimensions) - 0.5;
        let first = vec3<i32>(floor(point - PLACE_MARGIN));
        let last = vec3<i32>(floor(point + PLACE_MARGIN)) + 1;
        if any(first != before) || any(last != first + 1) {
            ask_for(first, last);
        }
        before = first;
    }
}

// Puts those voxels of a box that are not up to date on the list.
fn ask_for(first: vec3<i32>, last: vec3<i32>) {
    let limit = vec3<i32>(volume.dimensions) - 1;
    let low = clamp(first, vec3(0), limit);
    let high = clamp(last, vec3(0), limit);
    for (var z = low.z; z <= high.z; z += 1) {
        for (var y = low.y; y <= high.y; y += 1) {
            for (var x = low.x; x <= high.x; x += 1) {
                let voxel = vec3<u32>(vec3(x, y, z));
                let word = mask_word(voxel);
                let bit = mask_bit(voxel);
                let valid = &voxel_masks[mask_at(VALID, word)];
                // Reading is cheap, and almost all have been asked for.
                if (atomicLoad(valid) & bit) == 0u && (atomicOr(valid, bit) & bit) == 0u
                    && atomicOr(&voxel_masks[mask_at(PENDING, word)], bit) == 0u {
                    append(word);
                }
            }
        }
    }
}
