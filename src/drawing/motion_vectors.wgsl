// Motion vectors of a volume, as Bevy's prepass writes those of meshes: the way of a point in the image since the previous
// frame, in widths and heights of the view. A pixel has the motion of the point up to which half of the light is stopped.
// If a volume stops less, or an opaque mesh is in front of that point, the pixel keeps the motion behind.

#import bevy_contextual_ao::{
    drawn_box::corner_of_box,
    marched_view::{MarchedView, depth_of, ray_through},
    seen::first_run,
    stop::stop_behind_first_run,
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
    let stop = stop_behind_first_run(ray, first_run(marched_view, vec2<u32>(position.xy)), HALF);
    if stop.alpha < HALF {
        discard;
    }
    let point = vec4(ray.near + stop.along_mm * ray.direction, 1.0);
    let motion = place_of(clip_from_local[0] * point) - place_of(clip_from_local[1] * point);
    return FragmentOutput(motion, depth_of(marched_view, ray, stop.along_mm));
}
