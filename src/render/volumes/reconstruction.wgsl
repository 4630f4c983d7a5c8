// Intensities between voxels, and their gradient.
//
// TRICUBIC is the tricubic B-spline. It has no kinks at voxels, and smooths by about half a voxel. A B-spline's 64
// voxels take 8 trilinear samples (Sigg and Hadwiger 2005). The gradient is always that of the B-spline, from single
// voxels: the fractions of trilinear samples have too few bits for it.

#define_import_path bevy_contextual_ao::reconstruction

#import bevy_contextual_ao::volume_bindings::{edge_sampler, intensities, volume}

// Weights of 4 successive voxels at a place `f` behind the second.
fn spline(f: f32) -> vec4<f32> {
    let g = 1.0 - f;
    return vec4(g * g * g, 4.0 - 3.0 * f * f * (2.0 - f), 4.0 - 3.0 * g * g * (2.0 - g), f * f * f) / 6.0;
}

// Derivatives of these weights.
fn spline_slope(f: f32) -> vec4<f32> {
    let g = 1.0 - f;
    return 0.5 * vec4(-g * g, f * (3.0 * f - 4.0), g * (4.0 - 3.0 * g), f * f);
}

// Trilinear intensity at a place, in texture coordinates.
fn trilinear_at_place(p: vec3<f32>) -> f32 {
    return textureSampleLevel(intensities, edge_sampler, p, 0.0).r;
}

// Tricubic intensity at a place.
fn tricubic_at_place(p: vec3<f32>) -> f32 {
    let size = vec3<f32>(volume.dimensions);
    let place = p * size - 0.5;
    let first = floor(place);
    let f = place - first;
    let x = spline(f.x);
    let y = spline(f.y);
    let z = spline(f.z);
    let low = vec3(x[0] + x[1], y[0] + y[1], z[0] + z[1]);
    let high = 1.0 - low;
    let a = (first - 0.5 + vec3(x[1], y[1], z[1]) / low) / size;
    let b = (first + 1.5 + vec3(x[3], y[3], z[3]) / high) / size;
    var sum = 0.0;
    for (var k = 0u; k < 8u; k += 1u) {
        let is_high = vec3((k & 1u) != 0u, (k & 2u) != 0u, (k & 4u) != 0u);
        let weight = select(low, high, is_high);
        sum += weight.x * weight.y * weight.z * trilinear_at_place(select(a, b, is_high));
    }
    return sum;
}

// Places of two filtered samples along each axis, texture coordinates, and their weights: together those of a quadratic
// B-spline over three texels. Both samples share the middle one. So no rounding of their fractions reads a fourth.
struct Quadratic {
    low: vec3<f32>,
    high: vec3<f32>,
    low_weight: vec3<f32>,
}

fn quadratic(p: vec3<f32>, size: vec3<f32>) -> Quadratic {
    let place = p * size;
    let middle = floor(place) + 0.5;
    let f = place - middle;
    let before = 0.5 * (0.5 - f) * (0.5 - f);
    let behind = 0.5 * (0.5 + f) * (0.5 + f);
    let half = 0.5 * (0.75 - f * f);
    return Quadratic((middle - before / (before + half)) / size, (middle + behind / (behind + half)) / size, before + half);
}

// Trilinear intensities a voxel before and behind a place along each axis.
struct Around {
    before: vec3<f32>,
    behind: vec3<f32>,
}

fn trilinear_around(p: vec3<f32>) -> Around {
    let texel = 1.0 / vec3<f32>(volume.dimensions);
    let x = vec3(texel.x, 0.0, 0.0);
    let y = vec3(0.0, texel.y, 0.0);
    let z = vec3(0.0, 0.0, texel.z);
    return Around(
        vec3(trilinear_at_place(p - x), trilinear_at_place(p - y), trilinear_at_place(p - z)),
        vec3(trilinear_at_place(p + x), trilinear_at_place(p + y), trilinear_at_place(p + z)),
    );
}

// What the smooth filters say of a place.
struct Smooth {
    // Intensity that keeps details: the B-spline without the blur that it adds. The blur is a sixth of the second
    // differences along all axes, to the fourth order of a voxel's width.
    sharp: f32,
    // Way to the nearest place where the B-spline is as high as the trilinear intensity is here, texture coordinates.
    to_spline: vec3<f32>,
}

fn smooth_at_place(p: vec3<f32>) -> Smooth {
    let around = trilinear_around(p);
    let sum = dot(around.before + around.behind, vec3(1.0));
    let trilinear = trilinear_at_place(p);
    let spline = tricubic_at_place(p);
    let slope = 0.5 * (around.behind - around.before);
    let bend = (sum - 6.0 * trilinear) / 6.0;
    let way = (trilinear - spline) * slope / max(dot(slope, slope), 1e-12);
    let most = min(1.0, volume.occlusion_shift / max(length(way), 1e-9));
    return Smooth(spline - bend, most * way / vec3<f32>(volume.dimensions));
}

// Intensity at a place, by the filter of view rays.
fn intensity_at_place(p: vec3<f32>) -> f32 {
#ifdef TRICUBIC
    return tricubic_at_place(p);
#else
    return trilinear_at_place(p);
#endif
}

// Gradient of the intensity, per texture coordinate.
fn intensity_gradient(p: vec3<f32>) -> vec3<f32> {
    let place = p * vec3<f32>(volume.dimensions) - 0.5;
    let first = floor(place);
    let f = place - first;
    let x = spline(f.x);
    let x_slope = spline_slope(f.x);
    var y = spline(f.y);
    var y_slope = spline_slope(f.y);
    var z = spline(f.z);
    var z_slope = spline_slope(f.z);
    let last = vec3<i32>(volume.dimensions) - 1;
    let columns = clamp(vec4(i32(first.x)) + vec4(-1, 0, 1, 2), vec4(0), vec4(last.x));
    var sum = vec3(0.0);
    for (var k = 0; k < 16; k += 1) {
        let j = k % 4;
        let l = k / 4;
        let row = clamp(vec2<i32>(first.yz) + vec2(j, l) - 1, vec2(0), last.yz);
        let values = vec4(
            textureLoad(intensities, vec3(columns.x, row), 0).r,
            textureLoad(intensities, vec3(columns.y, row), 0).r,
            textureLoad(intensities, vec3(columns.z, row), 0).r,
            textureLoad(intensities, vec3(columns.w, row), 0).r,
        );
        let along = dot(values, x);
        sum += vec3(dot(values, x_slope) * y[j] * z[l], along * y_slope[j] * z[l], along * y[j] * z_slope[l]);
    }
    return sum * vec3<f32>(volume.dimensions);
}
