// Directional occlusion shading (Schott et al. 2009): one slice of a volume, perpendicular to the view's axis, seen
// through every pixel of a window. Slices run front to back. One buffer accumulates the colour that the eye sees.
// Another holds the share of the light of a cone towards the viewer that reaches a slice. Its mean over the base of
// a cone from slice to slice, times this slice's transmittance, is the share of the next slice. These are equations
// 10 to 15 and algorithms 1 to 3, with both buffers in one pass.
//
// Successive means widen with the root of the depth, not with the depth as a cone does. The base has the paper's radius
// for slices a voxel apart, and the root of the distance times that for others: the width does not depend on the distance.
//
// A slice is sampled as drawing does: classified after interpolation, clipped at the sample point. Tiles of 8x8 pixels
// keep whether all their light passes, or none. Where it is so in all tiles around, the mean is 1 or 0. An empty tile among
// lit ones has nothing to do, nor one among dark ones whose pixels are all opaque. A workgroup has several tiles, one after
// the other, because a workgroup costs a processor more than a tile.

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
    // Radius of the base of a cone from slice to slice, units of the view (equation 11), and the slope of the cone's side.
    radius: f32,
    cone_slope: f32,
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
// States of every tile after even slices, then after odd slices.
@group(1) @binding(6) var<storage, read_write> tile_states: array<u32>;
#ifdef MULTISAMPLED
@group(1) @binding(5) var opaque_depths: texture_depth_multisampled_2d;
#else
@group(1) @binding(5) var opaque_depths: texture_depth_2d;
#endif
// Number of the slice.
@group(2) @binding(0) var<storage, read> slice: u32;

// Pixels along each side of a tile.
const TILE: u32 = 8u;
// Tiles around a tile that its invocations can look at.
const MOST_REACH: u32 = 3u;
// States of a tile, as bits: all light reaches the next slice; none does; all pixels are opaque.
const LIT: u32 = 1u;
const DARK: u32 = 2u;
const CLOSED: u32 = 4u;
// Less light than this is none: a sixteenth of a byte's quantum.
const LEAST_LIGHT: f32 = 1.0 / 4096.0;
// States that not all tiles around this one have, and states that this tile does not have after the slice.
var<workgroup> not_around: atomic<u32>;
var<workgroup> not_here: atomic<u32>;

fn store_light(texel: vec2<u32>, light: f32) {
    atomicOr(&not_here, select(LIT, 0u, light == 1.0) | select(DARK, 0u, light == 0.0));
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

// Radius of the cone's base at a depth, pixels.
fn radius_at(depth: f32) -> vec2<f32> {
    return slicing.radius * slicing.pixels / (slicing.clip_w.x * depth + slicing.clip_w.y);
}

// Share of the light that reaches the next slice, through a slice of some opacity. Samples are the points of a
// grid that lie in the cone's base. `extent` is the size of the window with its ring.
fn light_through(texel: vec2<f32>, extent: vec2<f32>, depth: f32, opacity: f32, around: u32) -> f32 {
    let pixels_per_radius = radius_at(depth);
    let texture_size = vec2<f32>(textureDimensions(light_before));
    let per_mm = volume.draw_exponent / volume.draw_step_mm;
    let thickness = 1.0 - correct_opacity(opacity, slicing.slice_mm * per_mm);
    var sum = 0.0;
    var count = 0.0;
    if around == DARK {
        return 0.0;
    }
    if around == LIT && (slicing.exact_distance == 0u || opacity <= 0.0) {
        return thickness;
    }
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
                let way = length(vec3(offset * slicing.cone_slope, 1.0)) * slicing.slice_mm;
                transmittance = 1.0 - correct_opacity(opacity, way * per_mm);
            }
            sum += light * transmittance;
            count += 1.0;
        }
    }
    let mean = sum / count;
    return select(0.0, mean, mean >= LEAST_LIGHT);
}

// Number of tiles around a tile that the means of its pixels read.
fn tiles_read(depth: f32) -> u32 {
    let radius = radius_at(depth);
    return u32(clamp(ceil((max(radius.x, radius.y) + 1.0) / f32(TILE)), 1.0, 1e6));
}

// Shades a tile's pixel in this slice, and finds its light for the next.
fn shade_tile(tile: u32, counts: vec2<u32>, local: vec2<u32>, lane: u32) {
    let size = window.end - window.first;
    let place_of_tile = vec2(tile % counts.x, tile / counts.x);
    let texel = TILE * place_of_tile + local;
    let depth = slicing.first_depth + f32(slice) * slicing.slice_depth;
    let tiles = counts.x * counts.y;
    let place_behind = tiles * (slice & 1u) + tile;
    let place_before = tiles - tiles * (slice & 1u);
    // What this frame left two slices ago, where this slice writes, and one slice ago.
    let earlier = select(0u, tile_states[place_behind], slice >= 2u);
    let before = select(0u, tile_states[place_before + tile], slice >= 1u);
    let reach = tiles_read(depth);
    let side = 2u * reach + 1u;
    if slice == 0u {
        // Nothing is in front of the first slice.
        atomicOr(&not_around, DARK);
    } else if reach > MOST_REACH {
        atomicOr(&not_around, LIT | DARK);
    } else if lane < side * side {
        let other = vec2<i32>(place_of_tile) + vec2<i32>(vec2(lane % side, lane / side)) - i32(reach);
        // Beyond the window is light.
        var state = LIT;
        if all(other >= vec2(0)) && all(other < vec2<i32>(counts)) {
            state = tile_states[place_before + u32(other.y) * counts.x + u32(other.x)];
        }
        atomicOr(&not_around, ~state);
    }
    workgroupBarrier();
    let around = ~atomicLoad(&not_around) & (LIT | DARK);
    // Nothing changes any more in a closed tile among dark ones.
    let is_over = around == DARK && (before & CLOSED) != 0u && (earlier & DARK) != 0u;

    let is_inside = all(texel > vec2(0u)) && all(texel < size + 1u);
    let place = texel - 1u;
    let pixel = window.first + place;
    let index = place.y * size.x + place.x;
    let ray = view_ray(vec2<f32>(pixel) + 0.5, window, 0.0);
    let depth_per_mm = dot(slicing.depth_from_local.xyz, ray.direction);
    let along_mm = (depth - dot(slicing.depth_from_local, vec4(ray.near, 1.0))) / depth_per_mm;
    var sample = vec4(0.0);
    if is_inside && !is_over {
        sample = sample_at(ray, along_mm);
    }
    if is_inside && slice == 0u {
        eye[index] = vec4(0.0);
    }
    // An empty tile among lit ones stays lit.
    if sample.a > 0.0 || around != LIT {
        atomicOr(&not_here, LIT);
    }
    workgroupBarrier();
    let is_empty = (atomicLoad(&not_here) & LIT) == 0u;
    let is_written = is_over || is_empty && (earlier & LIT) != 0u;
    if is_written || any(texel >= size + 2u) {
        // The light behind is there already.
    } else if !is_inside {
        store_light(texel, 1.0);
    } else {
        if sample.a > 0.0 {
            var light = 1.0;
            var seen = vec4(0.0);
            if slice > 0u {
                let stored = textureLoad(light_before, texel, 0).rg;
                light = stored.r + stored.g;
                seen = eye[index];
            }
            if seen.a < OPAQUE && depth < opaque_depth(pixel) {
                let steps = slicing.slice_depth / depth_per_mm / volume.draw_step_mm;
                let opacity = (1.0 - seen.a) * correct_opacity(sample.a, steps * volume.draw_exponent);
                let p = ray.origin + along_mm * ray.velocity;
                seen += opacity * vec4(shade(sample.rgb, opacity, p, ray.direction, light, Cut(p, 0.0)), 1.0);
                // The small remainder has the same colour, not the background's.
                seen = select(seen, seen / seen.a, seen.a >= OPAQUE);
                eye[index] = seen;
            }
        }
        let extent = vec2<f32>(size + 2u);
        store_light(texel, light_through(vec2<f32>(texel) + 0.5, extent, depth, sample.a, around));
        if eye[index].a < OPAQUE {
            atomicOr(&not_here, CLOSED);
        }
    }
    workgroupBarrier();
    if lane == 0u {
        let now = ~atomicLoad(&not_here) & (LIT | DARK | CLOSED);
        tile_states[place_behind] = select(select(now, earlier, is_written), before, is_over);
    }
}

@compute @workgroup_size(8, 8)
fn slices(
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    // A ring of background surrounds the window.
    let counts = (window.end - window.first + 2u + TILE - 1u) / TILE;
    for (var tile = group.x; tile < counts.x * counts.y; tile += groups.x) {
        if lane == 0u {
            atomicStore(&not_around, 0u);
            atomicStore(&not_here, 0u);
        }
        workgroupBarrier();
        shade_tile(tile, counts, local.xy, lane);
    }
}
