// Marks the voxels that views will read: the stale ones around the runs of view rays (`runs`) become pending, and their
// words of the mask are listed. Drawing shades the same runs.
//
// Where there was no room for further runs of a ray, drawing follows the rest of the ray itself. Rounding may differ
// between two shaders: so all voxels that the rest might read are marked.

#import bevy_contextual_ao::{
    bricks::{MASK_BLOCK, PENDING, VALID, mask_at, mask_of_box, mask_word},
    marched_view::{
        MarchedView, OF_OUTLINES, OUTLINE_HEAD, VIEWS, has_flag, listed_pixels, outline_slot, place_of_ray,
        ray_through,
    },
    runs::{THEN_RUN, THEN_SAMPLES, lit_place, slice_of_run, slices_of, tells_place, unpack_run},
    seen::{first_run, runs},
    view_ray::{ViewRay, along_ray, samples_of},
    volume_bindings::volume,
    voxel_masks::voxel_masks,
    window::pixel_of_lane,
    work_list::{FRONT, append},
}

// Part of each view, pixels.
struct Part {
    first: vec2<u32>,
    end: vec2<u32>,
    // Distance from its cell up to which interpolation may read a texel, texels (`filter_probe`).
    place_margin: f32,
    padding: f32,
    more_padding: vec2<f32>,
}

@group(1) @binding(0) var<uniform> views: array<MarchedView, VIEWS>;
@group(1) @binding(1) var<uniform> parts: array<Part, VIEWS>;
// Lists of the pixels at outlines.
@group(1) @binding(2) var<storage, read> outlines: array<u32>;

// Voxels of a mask word at even places along all axes.
const EVEN_VOXELS: u32 = 0x0505u;

@compute @workgroup_size(64)
fn mark(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let view = group.z;
    let pixel = parts[view].first + 8u * group.xy + pixel_of_lane(lane);
    if any(pixel >= parts[view].end) {
        return;
    }
    // Rays of outlines take the places of pixels.
    let first_outline = views[view].first_outline;
    let slot = outline_slot(views[view], pixel);
    let is_of_outlines = has_flag(views[view], OF_OUTLINES);
    if is_of_outlines && slot >= listed_pixels(views[view], outlines[first_outline]) {
        return;
    }
    let place = place_of_ray(views[view], pixel, outlines[first_outline + OUTLINE_HEAD + slot]);
    let margin = parts[view].place_margin;
    let ray = ray_through(views[view], place);
    let count = samples_of(ray);
    var run = first_run(views[view], pixel);
    var slices = slices_of(run);
    var is_rest = false;
    var k = 0u;
    while true {
        // Almost all voxels were marked before: the search for others is a loop of its own.
        var texels = Texels(vec3(0), vec3(0));
        var is_stale = false;
        while k < slices && !is_stale {
            if is_rest {
                let along_mm = along_ray(ray, run.first + k);
                texels = texels_between(ray, along_mm, along_ray(ray, run.first + k + 1u), margin);
            } else if tells_place(run, k / 2u) {
                texels = texels_at(ray, lit_place(ray, run, k / 2u), margin);
                // The second slice of the pair has the same place.
                k += 1u;
            } else {
                let slice = slice_of_run(ray, run, k);
                texels = texels_between(ray, slice.begin_mm, slice.end_mm, margin);
            }
            is_stale = has_stale(texels);
            k += 1u;
        }
        if is_stale {
            mark_texels(texels);
        } else if !is_rest && run.then == THEN_RUN {
            run = unpack_run(runs[run.next]);
            slices = slices_of(run);
            k = 0u;
        } else if !is_rest && run.then == THEN_SAMPLES {
            // From the sample behind the run on, or from the first one of a ray without runs.
            is_rest = true;
            run.first += run.count;
            slices = max(count, run.first) - run.first;
            k = 0u;
        } else {
            break;
        }
    }
}

// Texels of the occlusion texture, first and last.
struct Texels {
    first: vec3<i32>,
    last: vec3<i32>,
}

// Texels that drawing reads at a distance along a ray: the nearest two along each axis, or three.
fn texels_at(ray: ViewRay, along_mm: f32, place_margin: f32) -> Texels {
    let margin = place_margin + volume.occlusion_shift / f32(volume.occlusion_stride);
    let p = ray.origin + along_mm * ray.velocity;
    let widening = volume.occlusion_widening;
    let point = p * vec3<f32>(volume.dimensions) / f32(volume.occlusion_stride) - 0.5 + 0.5 * widening;
    return Texels(vec3<i32>(floor(point - margin) - widening), vec3<i32>(floor(point + margin)) + 1);
}

// Texels of all places between two distances: where drawing lights a pair of slices, if its run does not tell.
fn texels_between(ray: ViewRay, begin_mm: f32, end_mm: f32, margin: f32) -> Texels {
    let a = texels_at(ray, begin_mm, margin);
    let b = texels_at(ray, end_mm, margin);
    return Texels(min(a.first, b.first), max(a.last, b.last));
}

// Voxels of some texels, in whose places the mask has bits: first and last, and a mask of those that stand for texels.
struct Voxels {
    low: vec3<u32>,
    high: vec3<u32>,
    standing: u32,
}

fn voxels_of(texels: Texels) -> Voxels {
    let stride = volume.occlusion_stride;
    let limit = (vec3<i32>(volume.dimensions) - 1) / i32(stride);
    let low = stride * vec3<u32>(clamp(texels.first, vec3(0), limit));
    let high = stride * vec3<u32>(clamp(texels.last, vec3(0), limit));
    return Voxels(low, high, select(EVEN_VOXELS, 0xffffffffu, stride == 1u));
}

// Number of words that voxels lie in along each axis.
fn words_of(voxels: Voxels) -> vec3<u32> {
    return voxels.high / MASK_BLOCK - voxels.low / MASK_BLOCK + 1u;
}

// The block of one of these words.
fn block_of(voxels: Voxels, words: vec3<u32>, k: u32) -> vec3<u32> {
    return voxels.low / MASK_BLOCK + vec3(k % words.x, (k / words.x) % words.y, k / (words.x * words.y));
}

fn has_stale(texels: Texels) -> bool {
    let voxels = voxels_of(texels);
    let words = words_of(voxels);
    var stale = 0u;
    for (var k = 0u; k < words.x * words.y * words.z; k += 1u) {
        let block = block_of(voxels, words, k);
        let valid = atomicLoad(&voxel_masks[mask_at(VALID, mask_word(block * MASK_BLOCK))]);
        stale |= mask_of_box(block, voxels.low, voxels.high) & voxels.standing & ~valid;
    }
    return stale != 0u;
}

fn mark_texels(texels: Texels) {
    let voxels = voxels_of(texels);
    let words = words_of(voxels);
    for (var k = 0u; k < words.x * words.y * words.z; k += 1u) {
        let block = block_of(voxels, words, k);
        let word = mask_word(block * MASK_BLOCK);
        let asked = mask_of_box(block, voxels.low, voxels.high) & voxels.standing;
        let valid = &voxel_masks[mask_at(VALID, word)];
        let stale = asked & ~atomicLoad(valid);
        if stale != 0u {
            let first_asked = stale & ~atomicOr(valid, stale);
            if first_asked != 0u && atomicOr(&voxel_masks[mask_at(PENDING, word)], first_asked) == 0u {
                append(FRONT, word);
            }
        }
    }
}
