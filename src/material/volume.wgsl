// Step VI of the CAO paper (section 3.5): front-to-back ray casting of a volume with the clip test
// (`view_ray`). Samples are shaded by the occlusion volume (V_AO) and, if set, by Blinn-Phong
// (`shading`).
//
// Drawn on the back faces of the volume's box, so that the camera may be inside the box. A ray ends
// at opaque geometry, by the depth of the prepass.

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
#ifdef ISOSURFACE
#import bevy_contextual_ao::surface_ray::surface_hit
#endif
#ifdef OCTANTS
#import bevy_contextual_ao::{
    octants::{Octants, high_octants_at, low_octants_at, octants_factor},
    orientation::inward,
}
#endif
#import bevy_contextual_ao::{
    shading::shade,
    view_ray::{OPAQUE, Slice, begin_march, next_slice, view_ray},
    volume_bindings::{correct_opacity, edge_sampler, volume},
}

@group(#{VOLUME_BIND_GROUP}) @binding(10) var occlusion: texture_3d<f32>;

// The share of the light that reaches a point.
fn ambient_at(p: vec3<f32>) -> f32 {
#ifdef OCTANTS
    let low = textureSampleLevel(occlusion, edge_sampler, low_octants_at(p), 0.0);
    let high = textureSampleLevel(occlusion, edge_sampler, high_octants_at(p), 0.0);
    let factor = octants_factor(Octants(low, high), inward(p));
#else
    let factor = textureSampleLevel(occlusion, edge_sampler, p * volume.occlusion_from_texture, 0.0).r;
#endif
    return mix(1.0, factor, volume.occlusion_share);
}

// Accumulated colour, premultiplied, and opacity.
struct Pixel {
    color: vec3<f32>,
    alpha: f32,
}

// Adds a slice of a ray to a pixel.
fn accumulate(before: Pixel, slice: Slice, direction: vec3<f32>) -> Pixel {
    var unit_opacity = slice.sample.a;
#ifdef MODULATED
    let share = textureSampleLevel(occlusion, edge_sampler, slice.p, 0.0).g;
    unit_opacity *= mix(1.0, share, volume.occlusion_share);
#endif
    let opacity =
        (1.0 - before.alpha) * correct_opacity(unit_opacity, slice.steps * volume.draw_exponent);
    if opacity <= 0.0 {
        return before;
    }
    let color = shade(slice.sample.rgb, opacity, slice.p, direction, ambient_at(slice.p));
    return Pixel(before.color + opacity * color, before.alpha + opacity);
}

@fragment
fn fragment(in: VertexOutput) -> @location(0) vec4<f32> {
    var ray = view_ray(in.position.xy, view.viewport, view.view_from_clip, view.world_from_view);
#ifdef DEPTH_PREPASS
    let depth = prepass_depth(in.position, 0u);
    // Depth is reversed: 0 is infinitely far, and no world position.
    if depth > 0.0 {
        let opaque_world = position_ndc_to_world(vec3(frag_coord_to_ndc(in.position).xy, depth));
        let opaque_local = (volume.local_from_world * vec4(opaque_world, 1.0)).xyz;
        ray.end_mm = min(ray.end_mm, dot(opaque_local - ray.near, ray.direction));
    }
#endif
#ifdef ISOSURFACE
    let hit = surface_hit(ray);
    // No branch on a hit: inside such a branch, the shading's branches would depend on uniforms alone.
    let color = shade(hit.color, hit.alpha, hit.p, ray.direction, ambient_at(hit.p));
    var pixel = Pixel(hit.alpha * color, hit.alpha);
#else
    var pixel = Pixel(vec3(0.0), 0.0);
    var march = begin_march(ray);
    while pixel.alpha < OPAQUE {
        let slice = next_slice(ray, &march);
        if slice.steps <= 0.0 {
            break;
        }
        pixel = accumulate(pixel, slice, ray.direction);
    }
#endif
    if pixel.alpha <= 0.0 {
        discard;
    }
    if pixel.alpha >= OPAQUE {
        // The little opacity that is left gets the pixel's own colour, not the background's.
        pixel = Pixel(pixel.color / pixel.alpha, 1.0);
    }
#ifdef TONEMAP_IN_SHADER
    let mapped = tone_mapping(vec4(pixel.color / pixel.alpha, 1.0), view.color_grading).rgb;
    pixel.color = mapped * pixel.alpha;
#endif
    return vec4(pixel.color, pixel.alpha);
}
