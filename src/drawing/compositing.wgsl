// Front-to-back compositing of the slices along a view ray that are seen (step VI of the CAO paper, section 3.5, `runs`).
// Slices are shaded by the occlusion volume (V_AO) and, if set, by Blinn-Phong (`shading`) or by the scene's lights
// (`scene_lights`): these light several slices at once. Other volumes may be in front of slices (`merged`).

#define_import_path bevy_contextual_ao::compositing

#ifdef MODULATED
#import bevy_contextual_ao::ambient_light::opacity_share_at
#endif
#ifdef MERGED
#import bevy_contextual_ao::{merged::{part, transmittance_of_others}, view_ray::along_of_depth}
#endif
#ifdef SCENE_LIGHTS
#import bevy_contextual_ao::scene_lights::{NOTHING_UNLIT, UnlitPart, is_significant, light_of, with_sample}
#endif
#import bevy_contextual_ao::{
    ambient_light::ambient_at,
    classification::classify,
    lit_slices::{NOTHING_SEEN, SeenPair, end_at, lit_mm, middle_of, note_lit, pair_of, seen_slice},
    next_run::{march_behind, next_run},
    orientation::{Cut, orientation_at},
    reconstruction::smooth_at_place,
    runs::{Run, Slice, THEN_RUN, THEN_SAMPLES, lit_place, slice_of_run, slices_of, tells_place, unpack_run},
    seen::runs,
    shading::shade,
    view_ray::{OPAQUE, ViewRay},
    volume_bindings::volume,
}

// Accumulated colour, premultiplied, and opacity.
struct Pixel {
    color: vec3<f32>,
    alpha: f32,
    // End of the last slice that is seen: its distance from the ray's start.
    end_mm: f32,
    // Mean distance of what is seen from the ray's start, times the opacity.
    mean_mm: f32,
#ifdef MERGED
    // The part of the opacity that no other volume hides.
    visible: f32,
#endif
#ifdef SCENE_LIGHTS
    // What counts in the opacity, and waits to be lit.
    unlit: UnlitPart,
#endif
}

fn empty_pixel() -> Pixel {
    return Pixel();
}

// The opacity that a pixel's colour is multiplied by.
fn visible_of(pixel: Pixel) -> f32 {
#ifdef MERGED
    return pixel.visible;
#else
    return pixel.alpha;
#endif
}

// A cut as seen from a point of the ray behind it.
fn cut_before(ray: ViewRay, cut_mm: f32, along_mm: f32) -> Cut {
    return Cut(ray.origin + cut_mm * ray.velocity, (along_mm - cut_mm) / volume.voxel_mm);
}

// Adds two slices to a pixel. They have colours of their own, and share the light of one place.
fn accumulate(before: Pixel, pair: SeenPair, along_mm: f32, end_mm: f32, ray: ViewRay, cut_mm: f32) -> Pixel {
    let near = pair.near;
    let far = pair.far;
    let opacity = near.opacity + far.opacity;
    if opacity <= 0.0 {
        return before;
    }
    var pixel = before;
    pixel.alpha += opacity;
    pixel.end_mm = end_mm;
    pixel.mean_mm += opacity * along_mm;
    // What each slice adds, and the share of the second in it.
    var added = opacity;
    var share = pair.share;
#ifdef MERGED
    let seen = vec2(
        near.opacity * transmittance_of_others(ray, near.along_mm),
        far.opacity * transmittance_of_others(ray, far.along_mm),
    );
    added = seen.x + seen.y;
    pixel.visible += added;
    if added <= 0.0 {
        return pixel;
    }
    share = seen.y / added;
#endif
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
    let base = mix(near_color, far_color, share);
    let ambient = ambient_at(occluded_at, cut);
#ifdef SCENE_LIGHTS
    pixel.unlit = with_sample(pixel.unlit, added, base, along_mm, ambient, orientation_at(p, cut));
#else
    pixel.color += added * shade(base, added, p, ray.direction, ambient, cut);
#endif
    return pixel;
}

// A slice of a run, up to the ray's end, from the begin of the part that is drawn on.
fn drawn_slice(ray: ViewRay, run: Run, number: u32) -> Slice {
    var slice = slice_of_run(ray, run, number);
#ifdef MERGED
    slice.begin_mm = max(slice.begin_mm, min(along_of_depth(ray, part.begin_depth), slice.end_mm));
    slice.steps = (slice.end_mm - slice.begin_mm) / volume.draw_step_mm;
#endif
    return slice;
}

// Adds the slices of a run from number `k` on. It ends where what was added is to be lit, and then may go on.
fn accumulate_slices(before: Pixel, run: Run, ray: ViewRay, next: ptr<function, u32>) -> Pixel {
    var pixel = before;
    var k = *next;
    // A ray that begins in the volume's box begins at a cut too.
    let cut_mm = select(select(-1e9, ray.begin_mm, run.first == 0u), run.cut_mm, run.has_cut);
    let slices = slices_of(run);
#ifdef MERGED
    // Pairs of slices in front of the part are passed over.
    while k + 2u < slices && slice_of_run(ray, run, k + 1u).end_mm <= along_of_depth(ray, part.begin_depth) {
        k += 2u;
    }
#endif
    var begin = end_at(ray, drawn_slice(ray, run, k).begin_mm);
    while k < slices && pixel.alpha < OPAQUE {
#ifdef SCENE_LIGHTS
        if is_significant(pixel.unlit) {
            break;
        }
#endif
        let number = k / 2u;
        var near = NOTHING_SEEN;
        var far = NOTHING_SEEN;
        var end_mm = 0.0;
        for (var j = 0u; j < 2u && k < slices && pixel.alpha + far.opacity < OPAQUE; j += 1u) {
            let slice = drawn_slice(ray, run, k);
            let end = end_at(ray, slice.end_mm);
            var share = 1.0;
#ifdef MODULATED
            share = opacity_share_at(middle_of(ray, slice));
#endif
            near = far;
            far = seen_slice(ray, slice, begin, end, pixel.alpha + near.opacity, share);
            begin = end;
            end_mm = slice.end_mm;
            // Opaque geometry hides the rest.
            k = select(k + 1u, slices, slice.steps < 0.0);
        }
        let pair = pair_of(near, far);
        let along_mm = select(lit_mm(pair), lit_place(ray, run, number), tells_place(run, number));
        pixel = accumulate(pixel, pair, along_mm, end_mm, ray, cut_mm);
    }
    *next = k;
    return pixel;
}

fn accumulate_run(before: Pixel, run: Run, ray: ViewRay) -> Pixel {
    var pixel = before;
    var next = 0u;
    while next < slices_of(run) && pixel.alpha < OPAQUE {
        pixel = accumulate_slices(pixel, run, ray, &next);
#ifdef SCENE_LIGHTS
        pixel.color += light_of(pixel.unlit, ray);
        pixel.unlit = NOTHING_UNLIT;
#endif
    }
    return pixel;
}

// What a ray sees, from its first run on.
fn pixel_of_ray(ray: ViewRay, first: Run) -> Pixel {
    var pixel = empty_pixel();
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

// The little opacity that is left gets a pixel's own colour, not the background's.
fn completed(pixel: Pixel) -> Pixel {
    if pixel.alpha >= OPAQUE {
        var whole = pixel;
        whole.color /= pixel.alpha;
#ifdef MERGED
        whole.visible /= pixel.alpha;
#endif
        whole.mean_mm /= pixel.alpha;
        whole.alpha = 1.0;
        return whole;
    }
    return pixel;
}
