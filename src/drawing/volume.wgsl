// Step VI of the CAO paper (section 3.5): front-to-back compositing of the slices along a view ray that are seen
// (`runs`). Slices are shaded by the occlusion volume (V_AO) and, if set, by Blinn-Phong (`shading`).
//
// Drawn on the back faces of the volume's box, so that the camera may be inside the box. A ray ends
// at opaque geometry, by the depth of the prepass.

#import bevy_pbr::{
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
    marched_view::MarchedView,
    next_run::{intensity_at, march_behind, next_run},
    runs::{Run, Slice, THEN_RUN, THEN_SAMPLES, slice_of_run, slices_of, unpack_run},
    seen::{first_run, runs},
    shading::shade,
    view_ray::{OPAQUE, ViewRay, samples_of, view_ray},
    volume_bindings::{classify_intensity, correct_opacity, edge_sampler, volume},
}

@group(#{VOLUME_BIND_GROUP}) @binding(12) var<uniform> marched_view: MarchedView;
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
fn accumulate(before: Pixel, slice: Slice, ray: ViewRay) -> Pixel {
    let p = ray.origin + slice.along_mm * ray.velocity;
    let sample = classify_intensity(intensity_at(ray, slice.along_mm));
    var unit_opacity = sample.a;
#ifdef MODULATED
    let share = textureSampleLevel(occlusion, edge_sampler, p, 0.0).g;
    unit_opacity *= mix(1.0, share, volume.occlusion_share);
#endif
    let opacity =
        (1.0 - before.alpha) * correct_opacity(unit_opacity, slice.steps * volume.draw_exponent);
    if slice.steps <= 0.0 || opacity <= 0.0 {
        return before;
    }
    let color = shade(sample.rgb, opacity, p, ray.direction, ambient_at(p));
    return Pixel(before.color + opacity * color, before.alpha + opacity);
}

fn accumulate_run(before: Pixel, run: Run, ray: ViewRay, end: u32) -> Pixel {
    var pixel = before;
    for (var k = 0u; k < slices_of(run) && pixel.alpha < OPAQUE; k += 1u) {
        let slice = slice_of_run(ray, run, k, end);
        // Opaque geometry hides the rest.
        if slice.steps < 0.0 {
            break;
        }
        pixel = accumulate(pixel, slice, ray);
    }
    return pixel;
}

// A corner of the volume's box, as one triangle strip around it.
@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let masks = vec3(0x287au, 0x02afu, 0x31e3u);
    var corner = vec3<f32>((masks >> vec3(index)) & vec3(1u));
    // The other way round, so that the faces still face outwards.
    corner.x = select(corner.x, 1.0 - corner.x, marched_view.is_mirrored != 0u);
    let local = volume.local_from_voxel * vec4(corner * vec3<f32>(volume.dimensions) - 0.5, 1.0);
    return marched_view.clip_from_local * local;
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let window = marched_view.window;
    var ray = view_ray(position.xy, window.viewport, window.view_from_clip, window.world_from_view);
#ifdef DEPTH_PREPASS
    let depth = prepass_depth(position, 0u);
    // Depth is reversed: 0 is infinitely far, and no world position.
    if depth > 0.0 {
        let opaque_world = position_ndc_to_world(vec3(frag_coord_to_ndc(position).xy, depth));
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
    let end = samples_of(ray);
    var run = first_run(marched_view, vec2<u32>(position.xy));
    // Two draws share the pixels: one of them can follow rays on, where runs found no room.
    let is_cut_off = run.is_cut_off;
    while true {
        pixel = accumulate_run(pixel, run, ray, end);
        if run.then != THEN_RUN || pixel.alpha >= OPAQUE {
            break;
        }
        run = unpack_run(runs[run.next]);
    }
#ifdef REST
    // The rest of a ray whose runs found no room, or that modulation lets go on.
    while run.then >= THEN_SAMPLES && pixel.alpha < OPAQUE {
        var march = march_behind(ray, run, pixel.alpha);
        run = next_run(ray, &march, OPAQUE);
        pixel = accumulate_run(pixel, run, ray, end);
    }
#endif
#ifdef CUT_OFF_ALONE
    pixel.alpha *= f32(is_cut_off);
#else ifndef REST
    pixel.alpha *= f32(!is_cut_off);
#endif
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
