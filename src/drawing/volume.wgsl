// Step VI of the CAO paper (section 3.5): draws what view rays see (`compositing`).
//
// Drawn on the back faces of the volume's box, so that the camera may be inside the box. A ray ends
// at opaque geometry, by the depth of the prepass. The samples of a multisampled pixel have one ray. Where it ends much
// farther away for some of them, at the outline of a mesh, two draws share the samples: FAR_SAMPLES draws those. Pixels at
// outlines of the volume have the mean of several rays (`outline_colors.wgsl`).

#import bevy_pbr::{
    mesh_view_bindings::view,
    view_transformations::{frag_coord_to_ndc, position_ndc_to_world},
}
#ifdef DEPTH_PREPASS
#import bevy_pbr::prepass_utils::prepass_depth
#ifdef MULTISAMPLED
#import bevy_pbr::mesh_view_bindings::depth_prepass_texture
#endif
#endif
#ifdef TONEMAP_IN_SHADER
#import bevy_core_pipeline::tonemapping::tone_mapping
#endif
#ifdef ISOSURFACE
#import bevy_contextual_ao::{
    ambient_light::ambient_at,
    orientation::NO_CUT,
    shading::shade,
    surface_ray::surface_hit,
}
#endif
#import bevy_contextual_ao::{
    compositing::{Pixel, completed, pixel_of_ray},
    drawn_box::corner_of_box,
    marched_view::{MarchedView, NOT_LISTED, NO_COLOR, listed_pixels, ray_through, word_of_color, word_of_slot},
    runs::no_run,
    seen::first_run,
    view_ray::ViewRay,
    volume_bindings::volume,
}

@group(#{VOLUME_BIND_GROUP}) @binding(12) var<uniform> marched_view: MarchedView;

// Lists of the pixels at outlines.
@group(#{VOLUME_BIND_GROUP}) @binding(13) var<storage, read> outlines: array<u32>;

// What the rays of a pixel at an outline see. It ends at NO_COLOR if the pixel has no rays but its own.
fn pixel_of_outline(pixel: vec2<u32>) -> Pixel {
    var seen = Pixel(vec3(0.0), 0.0, NO_COLOR);
    if listed_pixels(marched_view, outlines[marched_view.first_outline]) > 0u {
        let slot = outlines[word_of_slot(marched_view, pixel)];
        if slot != NOT_LISTED {
            let word = word_of_color(marched_view, slot);
            let red_green = unpack2x16float(outlines[word]);
            let blue_alpha = unpack2x16float(outlines[word + 1u]);
            seen = Pixel(vec3(red_green, blue_alpha.x), blue_alpha.y, bitcast<f32>(outlines[word + 2u]));
        }
    }
    return seen;
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return corner_of_box(marched_view, index);
}

#ifdef DEPTH_PREPASS
// Where a ray ends for a sample of its pixel, mm from `near`.
fn end_of_sample(ray: ViewRay, position: vec4<f32>, sample_index: u32) -> f32 {
    let depth = prepass_depth(position, sample_index);
    let opaque_world = position_ndc_to_world(vec3(frag_coord_to_ndc(position).xy, depth));
    let opaque_local = (volume.local_from_world * vec4(opaque_world, 1.0)).xyz;
    let opaque_mm = dot(opaque_local - ray.near, ray.direction);
    // Depth is reversed: 0 is infinitely far, and no world position.
    return select(min(ray.end_mm, opaque_mm), ray.end_mm, depth <= 0.0);
}
#endif

// Samples of a pixel that are drawn together, as a mask, and where their ray ends.
struct Samples {
    mask: u32,
    end_mm: f32,
    // Whether there are other samples.
    is_split: bool,
}

fn samples_of_pixel(ray: ViewRay, position: vec4<f32>) -> Samples {
#ifdef DEPTH_PREPASS
#ifdef MULTISAMPLED
    let count = u32(textureNumSamples(depth_prepass_texture));
    var nearest = ray.end_mm;
    var farthest = ray.begin_mm;
    for (var k = 0u; k < count; k += 1u) {
        let end_mm = max(end_of_sample(ray, position, k), ray.begin_mm);
        nearest = min(nearest, end_mm);
        farthest = max(farthest, end_mm);
    }
    let middle = 0.5 * (nearest + farthest);
    let is_split = farthest - nearest > 0.5 * volume.draw_step_mm;
    var far = 0u;
    for (var k = 0u; k < count; k += 1u) {
        far |= u32(is_split && end_of_sample(ray, position, k) > middle) << k;
    }
#ifdef FAR_SAMPLES
    return Samples(far, farthest, is_split);
#else
    return Samples(~far, select(middle, nearest, is_split), is_split);
#endif
#else
    return Samples(~0u, end_of_sample(ray, position, 0u), false);
#endif
#else
    return Samples(~0u, ray.end_mm, false);
#endif
}

struct FragmentOutput {
    @location(0) color: vec4<f32>,
#ifdef MULTISAMPLED
    @builtin(sample_mask) samples: u32,
#endif
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> FragmentOutput {
    var ray = ray_through(marched_view, position.xy);
    let samples = samples_of_pixel(ray, position);
    let is_ended_by_mesh = samples.end_mm < ray.end_mm;
    ray.end_mm = samples.end_mm;
#ifdef FAR_SAMPLES
    if samples.mask == 0u {
        discard;
    }
#endif
#ifdef ISOSURFACE
    let hit = surface_hit(ray);
    // No branch on a hit: inside such a branch, the shading's branches would depend on uniforms alone.
    let color = shade(hit.color, hit.alpha, hit.p, ray.direction, ambient_at(hit.p, NO_CUT), NO_CUT);
    var pixel = Pixel(hit.alpha * color, hit.alpha, 0.0);
#else
    // Rays of outlines were followed without regard to meshes. The pixel's own ray is drawn where a mesh ends what they see,
    // and at outlines of meshes.
    let outline = pixel_of_outline(vec2<u32>(position.xy));
    let is_in_front = !is_ended_by_mesh || samples.end_mm > ray.begin_mm && outline.end_mm <= samples.end_mm;
    let is_smooth = outline.end_mm != NO_COLOR && is_in_front && !samples.is_split;
    var run = first_run(marched_view, vec2<u32>(position.xy));
    var is_own = true;
    // Several draws share the pixels: rays whose runs found no room are followed by one draw.
#ifdef CUT_OFF_ALONE
    is_own = run.is_cut_off && !is_smooth;
#else ifndef REST
    is_own = !run.is_cut_off || is_smooth;
#endif
    if is_smooth {
        run = no_run();
    }
    var pixel = completed(pixel_of_ray(ray, run));
    if is_smooth {
        pixel = outline;
    }
    pixel.alpha *= f32(is_own);
#endif
    if pixel.alpha <= 0.0 {
        discard;
    }
#ifdef TONEMAP_IN_SHADER
    let mapped = tone_mapping(vec4(pixel.color / pixel.alpha, 1.0), view.color_grading).rgb;
    pixel.color = mapped * pixel.alpha;
#endif
#ifdef MULTISAMPLED
    return FragmentOutput(vec4(pixel.color, pixel.alpha), samples.mask);
#else
    return FragmentOutput(vec4(pixel.color, pixel.alpha));
#endif
}
