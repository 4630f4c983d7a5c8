// A view of a volume: its window, and where its runs are stored. The Rust side is `MarchedViewUniform`.
//
// Passes over several views have them in a uniform array, and know theirs by the workgroup. A software driver loads a
// view from there once for all lanes, but from a storage buffer for each lane: a third of the march.
//
// A view has one ray for each pixel. A multisampled view has another `MarchedView` behind it, with several rays for each
// pixel of an outline (`outlines.wgsl`). Their numbers take the places of pixels.

#define_import_path bevy_contextual_ao::marched_view

#import bevy_contextual_ao::{view_ray::{ViewRay, view_ray}, window::Window}

// Views in one dispatch.
const VIEWS: u32 = 16u;

struct MarchedView {
    window: Window,
    // Volume space (mm) → clip space.
    clip_from_local: mat4x4<f32>,
    // First and end pixel of the part to be marched in this frame, 16 bits for x and for y.
    part_first: u32,
    part_end: u32,
    // Index of the first run of the window's first pixel, and the end of the room for runs. Further runs of pixels follow
    // the first runs of all.
    first_run: u32,
    end_run: u32,
    // HAS_RUNS, IS_MIRRORED, OF_OUTLINES; from bit 16 on, the number of rays for each pixel of an outline.
    flags: u32,
    // Word of the list of outlines at which that of this view begins, and most pixels in it; 0 pixels: no outlines.
    first_outline: u32,
    most_outlines: u32,
    // Shift of the noise in this frame.
    noise_shift: f32,
}

// The runs of an earlier frame are there.
const HAS_RUNS: u32 = 1u;
// The view shows the volume mirrored.
const IS_MIRRORED: u32 = 2u;
// The view has the rays of outlines.
const OF_OUTLINES: u32 = 4u;

// The ray of a view through a place, pixels.
fn ray_through(view: MarchedView, place: vec2<f32>) -> ViewRay {
    return view_ray(place, view.window, view.noise_shift);
}

// Depth of the point of a ray, as depth textures have it. Points beyond the near or the far plane have theirs.
fn depth_of(view: MarchedView, ray: ViewRay, along_mm: f32) -> f32 {
    let clip = view.clip_from_local * vec4(ray.near + along_mm * ray.direction, 1.0);
    return saturate(clip.z / clip.w);
}

fn has_flag(view: MarchedView, flag: u32) -> bool {
    return (view.flags & flag) != 0u;
}

fn unpack_pixel(bits: u32) -> vec2<u32> {
    return vec2(bits & 0xffffu, bits >> 16u);
}

// Index of the first run of a pixel in the window.
fn run_of_pixel(view: MarchedView, pixel: vec2<u32>) -> u32 {
    let place = pixel - view.window.first;
    return view.first_run + place.y * (view.window.end.x - view.window.first.x) + place.x;
}

// Words before the pixels in a list of outlines: the number of pixels found, and the index of the first run of their rays.
// Behind the list is what the rays of these
// pixels see. Then each pixel of the window has its place in the list, or NOT_LISTED.
const OUTLINE_HEAD: u32 = 2u;
const OUTLINE_RUN: u32 = 1u;
const NOT_LISTED: u32 = 0xffffffffu;
// Words of what is seen: red and green, blue and opacity, all as half floats; the distance at which the last slice ends, mm,
// or NO_COLOR until it is known.
const COLOR_WORDS: u32 = 3u;
const NO_COLOR: f32 = -1.0;
// Number of rays for each pixel of an outline. 0: outlines have no rays of their own.
fn outline_rays(view: MarchedView) -> u32 {
    return view.flags >> 16u;
}

// Number of pixels in a view's list, by how many were found. A list without room for all has none: so the picture does not
// depend on their order.
fn listed_pixels(view: MarchedView, found: u32) -> u32 {
    return select(0u, found, found <= view.most_outlines);
}

// First word of what the rays of the pixel in a slot of the list see.
fn word_of_color(view: MarchedView, slot: u32) -> u32 {
    return view.first_outline + OUTLINE_HEAD + view.most_outlines + COLOR_WORDS * slot;
}

// Word with a pixel's place in the list.
fn word_of_slot(view: MarchedView, pixel: vec2<u32>) -> u32 {
    return word_of_color(view, view.most_outlines) + (run_of_pixel(view, pixel) - view.first_run);
}

// Place in the list of the pixel that a ray of an outline belongs to, by the ray's place in the window.
fn outline_slot(view: MarchedView, pixel: vec2<u32>) -> u32 {
    return select(0u, (run_of_pixel(view, pixel) - view.first_run) / outline_rays(view), has_flag(view, OF_OUTLINES));
}

// Where a view's ray goes through, pixels, by its place in the window. `listed` is the pixel in its slot of the list.
fn place_of_ray(view: MarchedView, pixel: vec2<u32>, listed: u32) -> vec2<f32> {
    let number = (run_of_pixel(view, pixel) - view.first_run) % outline_rays(view);
    let of_outline = vec2<f32>(unpack_pixel(listed)) + outline_offset(view, number);
    return select(vec2<f32>(pixel) + 0.5, of_outline, has_flag(view, OF_OUTLINES));
}

// Place of a ray of an outline in its pixel, pixels: a lattice by the golden ratio.
fn outline_offset(view: MarchedView, number: u32) -> vec2<f32> {
    let along = (f32(number) + 0.5) / f32(outline_rays(view));
    return vec2(along, fract((f32(number) + 0.5) * 0.6180339887498949));
}

// A ray of an outline, for passes with an invocation for each: the slot of its pixel in the list, its number in the pixel,
// and whether there is such a pixel.
struct OutlineRay {
    slot: u32,
    number: u32,
    is_listed: bool,
}

// The ray of an invocation, by its workgroup and its lane among `width`. A workgroup takes whole pixels. `found` is the number
// of pixels found.
fn outline_ray(view: MarchedView, found: u32, workgroup_number: u32, width: u32, lane: u32) -> OutlineRay {
    let rays = outline_rays(view);
    let at_once = width / rays;
    let slot = workgroup_number * at_once + lane / rays;
    return OutlineRay(slot, lane % rays, lane < at_once * rays && slot < listed_pixels(view, found));
}
