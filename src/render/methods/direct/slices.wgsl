// Direct occlusion shading (Schott et al. 2009): one slice of a volume, perpendicular to the view's axis, seen
// through every pixel of a window. Slices run front to back. One buffer accumulates the colour that the eye sees.
// Another holds the share of the light of a cone towards the viewer that reaches a slice. Its mean over the base of
// a cone from slice to slice, times this slice's transmittance, is the share of the next slice. These are equations
// 10 to 15 and algorithms 1 to 3, with both buffers in one pass.
//
// A slice is sampled as drawing does: classified after interpolation, clipped at the sample point.

#import bevy_contextual_ao::{
    brick_bindings::{carvers_near, distance_at},
    classification::{classify, correct_opacity},
    clip_test::is_visible,
    gradients::gradient_at,
    orientation::Cut,
    shading::shade,
    view_ray::{OPAQUE, ViewRay, view_ray},
    volume_bindings::{edge_sampler, intensities, may_be_visible, volume},
    window::Window,
}

struct Slicing {
    // Depth of a point of the volume (mm): its distance from the camera along the view's axis, in units of
    // the view.
    depth_from_local: vec4<f32>,
    // Depth of the first slice, and depth between slices.
    first_depth: f32,
    slice_depth: f32,
    // Distance between slices in the volume, mm.
    slice_mm: f32,
    // Radius of the cone's base, units of the view (equation 11).
    radius: f32,
    // Pixels per unit of the view, times clip w. Clip w is x * depth + y (equation 12).
    pixels: vec2<f32>,
    clip_w: vec2<f32>,
    // Samples along each side of the grid over the base. 1: each sample is attenuated along its own distance.
    samples: u32,
    exact_distance: u32,
}

@group(1) @binding(0) var<uniform> window: Window;
// Not a uniform, like the slice's number (4 in docs/drivers.md).
@group(1) @binding(1) var<storage, read> slicing: Slicing;
// Premultiplied colour and opacity so far, of every pixel of the window.
@group(1) @binding(2) var<storage, read_write> eye: array<vec4<f32>>;
// Share of the light that reaches this slice, and the next slice. A share is the sum of two channels, which
// filtering keeps. 16 bits alone lose the light that a thin mist absorbs in one slice. A ring of background
// surrounds the window.
@group(1) @binding(3) var light_before: texture_2d<f32>;
@group(1) @binding(4) var light_behind: texture_storage_2d<rgba16float, write>;
#ifdef MULTISAMPLED
@group(1) @binding(5) var opaque_depths: texture_depth_multisampled_2d;
#else
@group(1) @binding(5) var opaque_depths: texture_depth_2d;
#endif
// Number of the slice.
@group(2) @binding(0) var<storage, read> slice: u32;

fn store_light(texel: vec2<u32>, light: f32) {
    // The first channel keeps as many digits as 16 bits hold.
    let rounded = bitcast<f32>(bitcast<u32>(light) & 0xffffe000u);
    textureStore(light_behind, texel, vec4(rounded, light - rounded, 0.0, 0.0));
}

// Colour and opacity per unit distance at a point of a ray. Clipped points are transparent.
fn sample_at(ray: ViewRay, along_mm: f32) -> vec4<f32> {
    let p = ray.origin + along_mm * ray.velocity;
    let point = p * vec3<f32>(volume.dimensions);
    let is_inside = along_mm >= ray.begin_mm && along_mm <= ray.end_mm;
    if !is_inside || volume.draw_leaps * distance_at(0.25 * point) > 0u {
        return vec4(0.0);
    }
    let intensity = textureSampleLevel(intensities, edge_sampler, p, 0.0).r;
    if !may_be_visible(intensity) {
        return vec4(0.0);
    }
    let sample = classify(intensity, gradient_at(p));
    if sample.a <= 0.0 || !is_visible(ray.near + along_mm * ray.direction, carvers_near(point)) {
        return vec4(0.0);
    }
    return sample;
}

// Depth of the opaque mesh seen through a pixel.
fn opaque_depth(pixel: vec2<u32>) -> f32 {
    let depth = textureLoad(opaque_depths, pixel, 0);
    let ndc = (vec2<f32>(pixel) + 0.5 - window.viewport.xy) / window.viewport.zw * vec2(2.0, -2.0) + vec2(-1.0, 1.0);
    let point = window.view_from_clip * vec4(ndc, depth, 1.0);
    // Depth is reversed: 0 is infinitely far, or no mesh.
    return select(-point.z / point.w, 1e30, depth <= 0.0);
}

// Share of the light that reaches the next slice, through a slice of some opacity. Samples are the points of a
// grid that lie in the cone's base. `extent` is the size of the window with its ring.
fn light_through(texel: vec2<f32>, extent: vec2<f32>, depth: f32, opacity: f32) -> f32 {
    let clip_w = slicing.clip_w.x * depth + slicing.clip_w.y;
    let pixels_per_radius = slicing.radius * slicing.pixels / clip_w;
    let texture_size = vec2<f32>(textureDimensions(light_before));
    let per_mm = volume.draw_exponent / volume.draw_step_mm;
    let mm_per_unit = slicing.slice_mm / slicing.slice_depth;
    let thickness = 1.0 - correct_opacity(opacity, slicing.slice_mm * per_mm);
    var sum = 0.0;
    var count = 0.0;
    for (var y = 0u; y < slicing.samples; y += 1u) {
        for (var x = 0u; x < slicing.samples; x += 1u) {
            let offset = (2.0 * vec2(f32(x), f32(y)) + 1.0) / f32(slicing.samples) - 1.0;
            if dot(offset, offset) > 1.0 {
                continue;
            }
            let place = clamp(texel + offset * pixels_per_radius, vec2(0.5), extent - 0.5);
            let stored = textureSampleLevel(light_before, edge_sampler, place / texture_size, 0.0).rg;
            // Nothing is in front of the first slice.
            let light = select(stored.r + stored.g, 1.0, slice == 0u);
            var transmittance = thickness;
            if slicing.exact_distance != 0u && opacity > 0.0 {
                let way = length(vec3(offset * slicing.radius, slicing.slice_depth)) * mm_per_unit;
                transmittance = 1.0 - correct_opacity(opacity, way * per_mm);
            }
            sum += light * transmittance;
            count += 1.0;
        }
    }
    return sum / count;
}

@compute @workgroup_size(8, 8)
fn slices(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = window.end - window.first;
    let texel = id.xy;
    if any(texel >= size + 2u) {
        return;
    }
    if any(texel == vec2(0u)) || any(texel == size + 1u) {
        store_light(texel, 1.0);
        return;
    }
    let place = texel - 1u;
    let pixel = window.first + place;
    let ray = view_ray(vec2<f32>(pixel) + 0.5, window, 0.0);
    let depth = slicing.first_depth + f32(slice) * slicing.slice_depth;
    let depth_per_mm = dot(slicing.depth_from_local.xyz, ray.direction);
    let along_mm = (depth - dot(slicing.depth_from_local, vec4(ray.near, 1.0))) / depth_per_mm;
    let sample = sample_at(ray, along_mm);

    let index = place.y * size.x + place.x;
    var light = 1.0;
    var seen = vec4(0.0);
    if slice > 0u {
        let stored = textureLoad(light_before, texel, 0).rg;
        light = stored.r + stored.g;
        seen = eye[index];
    }
    if sample.a > 0.0 && seen.a < OPAQUE && depth < opaque_depth(pixel) {
        let steps = slicing.slice_depth / depth_per_mm / volume.draw_step_mm;
        let opacity = (1.0 - seen.a) * correct_opacity(sample.a, steps * volume.draw_exponent);
        let p = ray.origin + along_mm * ray.velocity;
        seen += opacity * vec4(shade(sample.rgb, opacity, p, ray.direction, light, Cut(p, 0.0)), 1.0);
        // The small remainder has the same colour, not the background's.
        seen = select(seen, seen / seen.a, seen.a >= OPAQUE);
        eye[index] = seen;
    } else if slice == 0u {
        eye[index] = seen;
    }

    store_light(texel, light_through(vec2<f32>(texel) + 0.5, vec2<f32>(size + 2u), depth, sample.a));
}
