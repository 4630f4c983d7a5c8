// Step VI of the CAO paper (section 3.5): front-to-back compositing of the slices along a view ray that are seen
// (`runs`). Slices are shaded by the occlusion volume (V_AO) and, if set, by Blinn-Phong (`shading`).
//
// Drawn on the back faces of the volume's box, so that the camera may be inside the box. A ray ends
// at opaque geometry, by the depth of the prepass. The samples of a multisampled pixel have one ray. Where it ends much
// farther away for some of them, at the outline of a mesh, two draws share the samples: FAR_SAMPLES draws those. At
// outlines of the volume, OUTLINES draws each listed pixel by the mean of several rays.

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
#ifdef MODULATED
#import bevy_contextual_ao::ambient_light::opacity_share_at
#endif
#ifdef ISOSURFACE
#import bevy_contextual_ao::surface_ray::surface_hit
#endif
#import bevy_contextual_ao::{
    ambient_light::ambient_at,
    classification::classify,
    drawn_box::corner_of_box,
    lit_slices::{NOTHING_SEEN, SeenPair, end_at, lit_mm, middle_of, note_lit, pair_of, seen_slice},
    marched_view::{MarchedView, NOT_LISTED, listed_pixels, outline_offset, outline_rays, ray_through, word_of_slot},
    next_run::{march_behind, next_run},
    orientation::{Cut, NO_CUT},
    reconstruction::smooth_at_place,
    runs::{Run, THEN_RUN, THEN_SAMPLES, lit_place, slice_of_run, slices_of, tells_place, unpack_run},
    seen::{first_run, run_at, runs},
    shading::shade,
    view_ray::{OPAQUE, ViewRay},
    volume_bindings::volume,
}

@group(#{VOLUME_BIND_GROUP}) @binding(12) var<uniform> marched_view: MarchedView;

// Accumulated colour, premultiplied, and opacity.
struct Pixel {
    color: vec3<f32>,
    alpha: f32,
}

// A cut as seen from a point of the ray behind it.
fn cut_before(ray: ViewRay, cut_mm: f32, along_mm: f32) -> Cut {
    return Cut(ray.origin + cut_mm * ray.velocity, (along_mm - cut_mm) / volume.voxel_mm);
}

// Adds two slices to a pixel. They have colours of their own, and share the light of one place.
fn accumulate(before: Pixel, pair: SeenPair, along_mm: f32, ray: ViewRay, cut_mm: f32) -> Pixel {
    let near = pair.near;
    let far = pair.far;
    let opacity = near.opacity + far.opacity;
    if opacity <= 0.0 {
        return before;
    }
    let p = ray.origin + along_mm * ray.velocity;
    let cut = cut_before(ray, cut_mm, along_mm);
    var occluded_at = p;
    // How much higher the smooth intensity is than the slices' own.
    var lift = 0.0;
#ifdef SMOOTH_COLORS
    let smooth_here = smooth_at_place(p);
    lift = smooth_here.sharp - mix(near.intensity, far.intensity, pair.share);
    // Trilinear surfaces have bumps between voxels, across which occlusion changes. It is looked up where a smooth
    // surface is.
    occluded_at += smooth_here.to_spline;
#endif
    let near_color = classify(near.intensity + lift, near.gradient).rgb;
    let far_color = classify(far.intensity + lift, far.gradient).rgb;
    let base = mix(near_color, far_color, pair.share);
    let color = shade(base, opacity, p, ray.direction, ambient_at(occluded_at, cut), cut);
    return Pixel(before.color + opacity * color, before.alpha + opacity);
}

fn accumulate_run(before: Pixel, run: Run, ray: ViewRay) -> Pixel {
    var pixel = before;
    // A ray that begins in the volume's box begins at a cut too.
    let cut_mm = select(select(-1e9, ray.begin_mm, run.first == 0u), run.cut_mm, run.has_cut);
    var begin = end_at(ray, slice_of_run(ray, run, 0u).begin_mm);
    let slices = slices_of(run);
    var k = 0u;
    while k < slices && pixel.alpha < OPAQUE {
        let number = k / 2u;
        var near = NOTHING_SEEN;
        var far = NOTHING_SEEN;
        for (var j = 0u; j < 2u && k < slices && pixel.alpha + far.opacity < OPAQUE; j += 1u) {
            let slice = slice_of_run(ray, run, k);
            let end = end_at(ray, slice.end_mm);
            var share = 1.0;
#ifdef MODULATED
            share = opacity_share_at(middle_of(ray, slice));
#endif
            near = far;
            far = seen_slice(ray, slice, begin, end, pixel.alpha + near.opacity, share);
            begin = end;
            // Opaque geometry hides the rest.
            k = select(k + 1u, slices, slice.steps < 0.0);
        }
        let pair = pair_of(near, far);
        let along_mm = select(lit_mm(pair), lit_place(ray, run, number), tells_place(run, number));
        pixel = accumulate(pixel, pair, along_mm, ray, cut_mm);
    }
    return pixel;
}

// Lists of the pixels at outlines.
@group(#{VOLUME_BIND_GROUP}) @binding(13) var<storage, read> outlines: array<u32>;

// A pixel's place in the list of outlines; NOT_LISTED if it is drawn by its own ray.
fn slot_of_pixel(pixel: vec2<u32>) -> u32 {
    if listed_pixels(marched_view, outlines[marched_view.first_outline]) == 0u {
        return NOT_LISTED;
    }
    return outlines[word_of_slot(marched_view, pixel)];
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

#ifndef ISOSURFACE
// What a ray sees, from its first run on.
fn pixel_of_ray(ray: ViewRay, first: Run) -> Pixel {
    var pixel = Pixel(vec3(0.0), 0.0);
    var run = first;
    while true {
        pixel = accumulate_run(pixel, run, ray);
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
        note_lit(&run, ray);
        pixel = accumulate_run(pixel, run, ray);
    }
#endif
    return pixel;
}
#endif

// The little opacity that is left gets a pixel's own colour, not the background's.
fn completed(pixel: Pixel) -> Pixel {
    if pixel.alpha >= OPAQUE {
        return Pixel(pixel.color / pixel.alpha, 1.0);
    }
    return pixel;
}

#ifdef OUTLINES
// What the rays of a listed pixel see, on average.
fn pixel_of_outline(position: vec4<f32>, slot: u32) -> Pixel {
    let rays = outline_rays(marched_view);
    var sum = Pixel(vec3(0.0), 0.0);
    for (var k = 0u; k < rays; k += 1u) {
        var ray = ray_through(marched_view, floor(position.xy) + outline_offset(marched_view, k));
        ray.end_mm = samples_of_pixel(ray, position).end_mm;
        let run = run_at(marched_view, marched_view.first_run + rays * slot + k);
        let seen = completed(pixel_of_ray(ray, run));
        sum = Pixel(sum.color + seen.color, sum.alpha + seen.alpha);
    }
    return Pixel(sum.color / f32(rays), sum.alpha / f32(rays));
}
#endif

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> FragmentOutput {
    var ray = ray_through(marched_view, position.xy);
    let samples = samples_of_pixel(ray, position);
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
    var pixel = Pixel(hit.alpha * color, hit.alpha);
#else ifdef OUTLINES
    let slot = slot_of_pixel(vec2<u32>(position.xy));
    // Pixels at outlines of meshes too are drawn by their own ray.
    if slot == NOT_LISTED || samples.is_split {
        discard;
    }
    var pixel = pixel_of_outline(position, slot);
#else
    let run = first_run(marched_view, vec2<u32>(position.xy));
    var pixel = completed(pixel_of_ray(ray, run));
    // Several draws share the pixels: rays of outlines take the place of others, and rays whose runs found no room are
    // followed by one draw.
    var is_own = samples.is_split || slot_of_pixel(vec2<u32>(position.xy)) == NOT_LISTED;
#ifdef CUT_OFF_ALONE
    is_own = is_own && run.is_cut_off;
#else ifndef REST
    is_own = is_own && !run.is_cut_off;
#endif
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
