// Step VI of the CAO paper (section 3.5): draws what view rays see (`compositing`).
//
// Drawn on the back faces of the volume's box, so that the camera may be inside the box. A ray ends
// at opaque geometry, by the depth of the prepass. The samples of a multisampled pixel have one ray. Where it ends much
// farther away for some of them, at the outline of a mesh, two draws share the samples: FAR_SAMPLES draws those. Pixels at
// outlines of the volume have the mean of several rays (`outline_colors.wgsl`). Fog is that at the end of what is seen.
//
// Of volumes that share space, and between translucent meshes, a part of each ray is drawn (`merged`).
//
// What is opaque does not hide nearer things of the main pass that the prepass lacks, such as gizmos and other volumes. Where
// a view sorts transparent fragments (OIT_ENABLED), a pixel's is one of them, at the mean place of what is seen.

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
#ifdef DEBAND_DITHER
#import bevy_core_pipeline::tonemapping::screen_space_dither
#import bevy_render::maths::powsafe
#endif
#endif
#ifdef OIT_ENABLED
#import bevy_core_pipeline::oit::oit_draw
#endif
#ifdef DISTANCE_FOG
#import bevy_pbr::{mesh_view_bindings::fog, pbr_functions::apply_fog}
#endif
#ifdef ISOSURFACE
#import bevy_contextual_ao::{
    ambient_light::ambient_at,
    orientation::{NO_CUT, orientation_at},
    shading::shade,
    surface_ray::surface_hit,
}
#ifdef SCENE_LIGHTS
#import bevy_contextual_ao::scene_lights::{NOTHING_UNLIT, light_of, with_sample}
#endif
#endif
#ifdef MERGED
#import bevy_contextual_ao::{
    merged::{begin_part, part, transmittance_of_others},
    view_ray::along_of_depth,
}
#endif
#import bevy_contextual_ao::{
    compositing::{Pixel, completed, empty_pixel, pixel_of_ray, visible_of},
    drawn_box::corner_of_box,
    marched_view::{
        MarchedView, NOT_LISTED, NO_COLOR, OUTLINE_RUN, depth_of, listed_pixels, outline_offset, outline_rays, ray_through, word_of_color,
        word_of_slot,
    },
    runs::{no_run, unpack_run},
    seen::{first_run, runs},
    view_ray::ViewRay,
    volume_bindings::volume,
}

@group(#{VOLUME_BIND_GROUP}) @binding(12) var<uniform> marched_view: MarchedView;

// Lists of the pixels at outlines.
@group(#{VOLUME_BIND_GROUP}) @binding(13) var<storage, read> outlines: array<u32>;

// Place of a pixel in the list of outlines, or NOT_LISTED.
fn slot_of(pixel: vec2<u32>) -> u32 {
    var slot = NOT_LISTED;
    if listed_pixels(marched_view, outlines[marched_view.first_outline]) > 0u {
        slot = outlines[word_of_slot(marched_view, pixel)];
    }
    return slot;
}

#ifdef FOLLOWS_OUTLINES
// What a pixel sees: the mean of its rays at an outline, else of its own ray. The lights of the scene, and the volumes that
// share the space, are known to fragments alone. So the rays are followed here, each up to the opaque geometry of the pixel.
fn pixel_of_rays(own: ViewRay, pixel: vec2<u32>, slot: u32) -> Pixel {
    let is_listed = slot != NOT_LISTED;
    let count = select(1u, outline_rays(marched_view), is_listed);
    var seen = empty_pixel();
    for (var k = 0u; k < count; k += 1u) {
        var ray = own;
        var run = first_run(marched_view, pixel);
        if is_listed {
            ray = ray_through(marched_view, vec2<f32>(pixel) + outline_offset(marched_view, k));
            ray.end_mm = min(ray.end_mm, own.end_mm);
            run = unpack_run(runs[outlines[marched_view.first_outline + OUTLINE_RUN] + count * slot + k]);
        }
        let one = completed(pixel_of_ray(ray, run));
        seen.color += one.color / f32(count);
        seen.alpha += one.alpha / f32(count);
#ifdef MERGED
        seen.visible += one.visible / f32(count);
#endif
        seen.end_mm = max(seen.end_mm, one.end_mm);
        seen.mean_mm += one.mean_mm / f32(count);
    }
    return seen;
}
#else
// What the rays of a pixel in the list of outlines see. It ends at NO_COLOR if the pixel is not listed.
fn pixel_of_outline(slot: u32) -> Pixel {
    var seen = empty_pixel();
    seen.end_mm = NO_COLOR;
    if slot != NOT_LISTED {
        let word = word_of_color(marched_view, slot);
        let red_green = unpack2x16float(outlines[word]);
        let blue_alpha = unpack2x16float(outlines[word + 1u]);
        seen.color = vec3(red_green, blue_alpha.x);
        seen.alpha = blue_alpha.y;
        seen.end_mm = bitcast<f32>(outlines[word + 2u]);
        seen.mean_mm = seen.alpha * seen.end_mm;
    }
    return seen;
}
#endif

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
    @builtin(frag_depth) depth: f32,
#ifdef MULTISAMPLED
    @builtin(sample_mask) samples: u32,
#endif
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> FragmentOutput {
    let pixel_place = vec2<u32>(position.xy);
    var ray = ray_through(marched_view, position.xy);
#ifdef MERGED
    begin_part(pixel_place);
    ray.end_mm = min(ray.end_mm, along_of_depth(ray, part.end_depth));
#endif
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
    let ambient = ambient_at(hit.p, NO_CUT);
    var pixel = empty_pixel();
    pixel.alpha = hit.alpha;
    pixel.end_mm = hit.along_mm;
    var added = hit.alpha;
#ifdef MERGED
    added *= f32(hit.along_mm > along_of_depth(ray, part.begin_depth)) * transmittance_of_others(ray, hit.along_mm);
    pixel.visible = added;
#endif
    pixel.mean_mm = hit.alpha * hit.along_mm;
#ifdef SCENE_LIGHTS
    let orientation = orientation_at(hit.p, NO_CUT);
    pixel.color = light_of(with_sample(NOTHING_UNLIT, added, hit.color, hit.along_mm, ambient, orientation), ray);
#else
    pixel.color = added * shade(hit.color, added, hit.p, ray.direction, ambient, NO_CUT);
#endif
#else
    let slot = select(slot_of(pixel_place), NOT_LISTED, samples.is_split);
    var is_own = true;
    // Several draws share the pixels: rays whose runs found no room are followed by one draw.
#ifdef FOLLOWS_OUTLINES
    let is_smooth = slot != NOT_LISTED;
#else
    // Rays of outlines were followed without regard to meshes. The pixel's own ray is drawn where a mesh ends what they see,
    // and at outlines of meshes.
    let outline = pixel_of_outline(slot);
    let is_in_front = !is_ended_by_mesh || samples.end_mm > ray.begin_mm && outline.end_mm <= samples.end_mm;
    let is_smooth = outline.end_mm != NO_COLOR && is_in_front;
#endif
    var run = first_run(marched_view, pixel_place);
#ifdef CUT_OFF_ALONE
    is_own = run.is_cut_off && !is_smooth;
#else ifndef REST
    is_own = !run.is_cut_off || is_smooth;
#endif
#ifdef FOLLOWS_OUTLINES
    var pixel = pixel_of_rays(ray, pixel_place, slot);
#else
    if is_smooth {
        run = no_run();
    }
    var pixel = completed(pixel_of_ray(ray, run));
    if is_smooth {
        pixel = outline;
    }
#endif
    pixel.alpha *= f32(is_own);
#ifdef MERGED
    pixel.visible *= f32(is_own);
#endif
#endif
    let visible = visible_of(pixel);
    if visible <= 0.0 {
        discard;
    }
    // Rounding must not put what is seen behind the mesh that ends the ray.
    let depth = depth_of(marched_view, ray, pixel.mean_mm / pixel.alpha - volume.draw_step_mm);
#ifdef MERGED
    // What is behind is dimmed already.
    pixel.alpha = select(pixel.alpha, 0.0, part.is_shared);
#endif
#ifdef DISTANCE_FOG
    let seen_world = (volume.world_from_local * vec4(ray.near + pixel.end_mm * ray.direction, 1.0)).xyz;
    let fogged = apply_fog(fog, vec4(pixel.color / visible, 1.0), seen_world, view.world_position.xyz, position.xy);
    pixel.color = fogged.rgb * visible;
#endif
#ifdef TONEMAP_IN_SHADER
    var mapped = tone_mapping(vec4(pixel.color / visible, 1.0), view.color_grading).rgb;
    // Unmapped colours are shown as they are.
#ifdef DEBAND_DITHER
#ifndef TONEMAP_METHOD_NONE
    mapped = powsafe(powsafe(mapped, 1.0 / 2.2) + screen_space_dither(position.xy), 2.2);
#endif
#endif
    pixel.color = mapped * visible;
#endif
#ifdef OIT_ENABLED
    oit_draw(vec4(position.xy, depth, position.w), vec4(pixel.color / pixel.alpha, pixel.alpha));
    // The list's colours are drawn behind all transparent objects.
    discard;
#endif
    // What is translucent has no depth: it is in front of all.
    let tested_depth = select(1.0, depth, pixel.alpha >= 1.0);
#ifdef MULTISAMPLED
    return FragmentOutput(vec4(pixel.color, pixel.alpha), tested_depth, samples.mask);
#else
    return FragmentOutput(vec4(pixel.color, pixel.alpha), tested_depth);
#endif
}
