// Motion vectors of a volume, as Bevy's prepass writes those of meshes: the way of a point in the image since the previous
// frame, in widths and heights of the view. A pixel has the motion of the point up to which half of the light is stopped.
// If a volume stops less, or an opaque mesh is in front of that point, the pixel keeps the motion behind.

#import bevy_contextual_ao::{
    drawn_box::corner_of_box,
    marched_view::{MarchedView, ray_through},
    next_run::march_before,
    runs::{THEN_END, slices_of},
    seen::first_run,
    stop::stop_of,
}

// Volume space (mm) → clip space without the projection's jitter: in this frame, and in the previous one. A fourth uniform
// buffer crashes a driver (6 in docs/drivers.md).
@group(0) @binding(0) var<storage, read> clip_from_local: array<mat4x4<f32>, 2>;
@group(#{VOLUME_BIND_GROUP}) @binding(12) var<uniform> marched_view: MarchedView;

// Opacity up to the point whose motion a pixel has.
const HALF: f32 = 0.5;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return corner_of_box(marched_view, index);
}

struct FragmentOutput {
    @location(0) motion: vec2<f32>,
    @builtin(frag_depth) depth: f32,
}

// Place in the image, widths and heights of the view.
fn place_of(clip: vec4<f32>) -> vec2<f32> {
    return clip.xy / clip.w * vec2(0.5, -0.5);
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> FragmentOutput {
    let ray = ray_through(marched_view, position.xy);
    // What the march found in front of the first run is empty. Without runs, the ray is followed from its start.
    let first = first_run(marched_view, vec2<u32>(position.xy));
    var march = march_before(ray, first);
    // An empty ray is not followed.
    march.count = select(0u, march.count, slices_of(first) > 0u || first.then != THEN_END);
    let stop = stop_of(ray, march, HALF);
    if stop.alpha < HALF {
        discard;
    }
    let point = vec4(ray.near + stop.along_mm * ray.direction, 1.0);
    let clip = marched_view.clip_from_local * point;
    let motion = place_of(clip_from_local[0] * point) - place_of(clip_from_local[1] * point);
    return FragmentOutput(motion, clip.z / clip.w);
}
