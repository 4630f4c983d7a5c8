// Step VI of the CAO paper (section 3.5): front-to-back ray casting of a volume with the clip test
// at every sample. Samples are classified after interpolation, shaded by the occlusion volume
// (V_AO) and, where asked for, by Blinn-Phong with gradients of the clipped opacity (V_o, 3D
// Sobel) and a light at the camera. Where a ray enters or leaves a carver, the cut is found and
// sampled: the paper samples at steps alone.
//
// No branch depends on uniforms alone: Mesa's software driver compiles such shaders anew in every
// draw, and (22.3) never frees what it made.
//
// Drawn on the back faces of the volume's box, so that the camera may be inside it; opaque
// geometry ends a ray where the depth prepass has it.

#import bevy_pbr::{
    forward_io::VertexOutput,
    mesh_view_bindings::view,
    view_transformations::{frag_coord_to_ndc, position_ndc_to_world},
}
#ifdef DEPTH_PREPASS
#import bevy_pbr::prepass_utils::prepass_depth
#endif
#ifdef TONEMAP_IN_SHADER
#import bevy_core_pipeline::tonemapping::tone_mapping
#endif
#import bevy_contextual_ao::{
    clip_test::is_visible,
    volume_bindings::{
        classify_intensity, correct_opacity, edge_sampler, intensities, volume,
    },
}

@group(#{VOLUME_BIND_GROUP}) @binding(7) var opacities: texture_3d<f32>;
@group(#{VOLUME_BIND_GROUP}) @binding(8) var occlusion: texture_3d<f32>;

// A ray is finished when this much is accumulated.
const OPAQUE: f32 = 0.99;
// A cut is found to within this power of two of a step: less than a byte of shading.
const CUT_HALVINGS: i32 = 6;
// What a sample is: transparent, opaque, or opaque but clipped.
const EMPTY: u32 = 0u;
const VISIBLE: u32 = 1u;
const CLIPPED: u32 = 2u;
// Blinn-Phong coefficients.
const AMBIENT: f32 = 0.3;
const DIFFUSE: f32 = 0.7;
const SPECULAR: f32 = 0.2;
const SHININESS: f32 = 16.0;

// Interleaved gradient noise (Jimenez 2014), [0, 1).
fn noise(pixel: vec2<f32>) -> f32 {
    return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
}

// Gradient of the clipped opacity in volume space, up to a factor: 3D Sobel over 26 neighbours.
fn opacity_gradient(p: vec3<f32>) -> vec3<f32> {
    let texel = 1.0 / vec3<f32>(volume.dimensions);
    var gradient = vec3(0.0);
    for (var k = 0; k < 27; k += 1) {
        let offset = vec3<f32>(vec3(k % 3, (k / 3) % 3, k / 9) - 1);
        let weight = vec3(2.0) - abs(offset);
        let opacity = textureSampleLevel(opacities, edge_sampler, p + offset * texel, 0.0).r;
        gradient += opacity * offset * vec3(weight.y * weight.z, weight.x * weight.z, weight.x * weight.y);
    }
    // Per voxel → per texture coordinate → per mm.
    let per_texture = gradient * vec3<f32>(volume.dimensions);
    return (transpose(volume.texture_from_local) * vec4(per_texture, 0.0)).xyz;
}

// Colour of a sample lit from the camera, which looks along `direction`.
// `opacity` is what it adds to the pixel.
fn shade(color: vec3<f32>, opacity: f32, p: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    let factor = textureSampleLevel(occlusion, edge_sampler, p, 0.0).r;
    let ambient = mix(1.0, factor, volume.occlusion_share);
    if opacity * volume.light_share <= 0.0 {
        return color * ambient;
    }
    let gradient = opacity_gradient(p);
    let steepness = length(gradient);
    // Where the opacity does not change there is no surface to light.
    let facing = select(1.0, abs(dot(gradient, direction)) / steepness, steepness > 1e-6);
    let highlight = select(0.0, SPECULAR * pow(facing, SHININESS), steepness > 1e-6);
    return color * (AMBIENT + DIFFUSE * facing) * ambient + highlight;
}

// Colour and opacity so far, premultiplied.
struct Pixel {
    color: vec3<f32>,
    alpha: f32,
}

fn classify(p: vec3<f32>) -> vec4<f32> {
    return classify_intensity(textureSampleLevel(intensities, edge_sampler, p, 0.0).r);
}

// Adds a sample that stands for so many steps of the ray.
fn accumulate(before: Pixel, sample: vec4<f32>, p: vec3<f32>, direction: vec3<f32>, steps: f32) -> Pixel {
    let opacity = (1.0 - before.alpha) * correct_opacity(sample.a, steps * volume.draw_exponent);
    if opacity <= 0.0 {
        return before;
    }
    return Pixel(before.color + opacity * shade(sample.rgb, opacity, p, direction), before.alpha + opacity);
}

// Where a ray is cut between a visible and a clipped point, given by their distances from `near`:
// the last visible point found by halving.
fn cut_between(near: vec3<f32>, direction: vec3<f32>, visible_at: f32, clipped_at: f32) -> f32 {
    var visible_mm = visible_at;
    var clipped_mm = clipped_at;
    for (var k = 0; k < CUT_HALVINGS; k += 1) {
        let middle_mm = 0.5 * (visible_mm + clipped_mm);
        if is_visible(near + middle_mm * direction) {
            visible_mm = middle_mm;
        } else {
            clipped_mm = middle_mm;
        }
    }
    return visible_mm;
}

@fragment
fn fragment(in: VertexOutput, @builtin(front_facing) is_front: bool) -> @location(0) vec4<f32> {
    // A mirrored volume shows its back faces as front faces.
    let linear = mat3x3(volume.local_from_world[0].xyz, volume.local_from_world[1].xyz, volume.local_from_world[2].xyz);
    if is_front == (determinant(linear) > 0.0) {
        discard;
    }
    // The view ray in volume space: from the near plane to the back face, in mm.
    let ndc = frag_coord_to_ndc(in.position);
    let near = (volume.local_from_world * vec4(position_ndc_to_world(vec3(ndc.xy, 1.0)), 1.0)).xyz;
    let back = (volume.local_from_world * vec4(in.world_position.xyz, 1.0)).xyz;
    let direction = normalize(back - near);
    var end_mm = distance(near, back);
#ifdef DEPTH_PREPASS
    let depth = prepass_depth(in.position, 0u);
    // Depth is reversed: 0 is infinitely far, and no world position.
    if depth > 0.0 {
        let opaque_world = position_ndc_to_world(vec3(ndc.xy, depth));
        let opaque_local = (volume.local_from_world * vec4(opaque_world, 1.0)).xyz;
        end_mm = min(end_mm, dot(opaque_local - near, direction));
    }
#endif
    // Where the ray enters the box, or the near plane if that is inside.
    let origin = (volume.texture_from_local * vec4(near, 1.0)).xyz;
    let velocity = (volume.texture_from_local * vec4(direction, 0.0)).xyz;
    let to_planes = (select(vec3(0.0), vec3(1.0), velocity < vec3(0.0)) - origin) / velocity;
    // A ray parallel to two planes and between them divides 0 or more by 0: no bound.
    let entries = select(to_planes, vec3(0.0), abs(velocity) < vec3(1e-9));
    let start_mm = max(0.0, max(entries.x, max(entries.y, entries.z)));

    let offset = mix(0.5, noise(floor(in.position.xy)), volume.jitter_share);
    var pixel = Pixel(vec3(0.0), 0.0);
    var before = EMPTY;
    var last = vec4(0.0);
    var last_p = vec3(0.0);
    let count = u32(max(ceil((end_mm - start_mm) / volume.draw_step_mm - offset), 0.0));
    for (var i = 0u; i < count; i += 1u) {
        let along = start_mm + (f32(i) + offset) * volume.draw_step_mm;
        let p = origin + along * velocity;
        let sample = classify(p);
        var now = EMPTY;
        if sample.a > 0.0 {
            now = select(CLIPPED, VISIBLE, is_visible(near + along * direction));
        }
        let step_mm = volume.draw_step_mm;
        if before == VISIBLE {
            // The sample before stands for the step from there to here, as far as it is not cut.
            var steps = 1.0;
            if now == CLIPPED {
                steps += (cut_between(near, direction, along - step_mm, along) - along) / step_mm;
            }
            pixel = accumulate(pixel, last, last_p, direction, steps);
        } else if before == CLIPPED && now == VISIBLE {
            // What is left of the step is sampled at the cut: surfaces stay where they are when a
            // carver moves by less than a step, and are as smooth as the carver.
            let cut_mm = cut_between(near, direction, along, along - step_mm);
            let cut = origin + cut_mm * velocity;
            pixel = accumulate(pixel, classify(cut), cut, direction, (along - cut_mm) / step_mm);
        }
        before = now;
        last = sample;
        last_p = p;
        if pixel.alpha >= OPAQUE {
            // What little is left is of the same colour, not of the background's.
            pixel = Pixel(pixel.color / pixel.alpha, 1.0);
            before = EMPTY;
            break;
        }
    }
    if before == VISIBLE {
        pixel = accumulate(pixel, last, last_p, direction, 1.0);
    }
    if pixel.alpha <= 0.0 {
        discard;
    }
#ifdef TONEMAP_IN_SHADER
    let mapped = tone_mapping(vec4(pixel.color / pixel.alpha, 1.0), view.color_grading).rgb;
    pixel.color = mapped * pixel.alpha;
#endif
    return vec4(pixel.color, pixel.alpha);
}
