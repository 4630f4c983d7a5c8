// Follows the view rays of a volume once, for all views at the same time, and stores each ray's runs (`runs`).
// Occlusion is then computed where the runs read it, and drawing shades the runs: neither follows a ray again. Samples
// that opaque meshes will hide are not known yet: somewhat more is found than is drawn, never less.

#import bevy_contextual_ao::{
    lit_slices::note_lit,
    marched_view::{
        HAS_RUNS, MarchedView, OF_OUTLINES, OUTLINE_HEAD, VIEWS, has_flag, listed_pixels, outline_slot, place_of_ray, ray_through,
        run_of_pixel, unpack_pixel,
    },
    next_run::{begin_march, next_run},
    runs::{CUT_OFF, NO_RUN, THEN_END, THEN_RUN, THEN_SAMPLES, no_run, pack_run, slices_of, unpack_run},
    view_ray::OPAQUE,
    window::pixel_of_lane,
}

@group(1) @binding(0) var<uniform> views: array<MarchedView, VIEWS>;
@group(1) @binding(1) var<storage, read_write> runs: array<vec4<u32>>;
// Number of further runs of each view.
@group(1) @binding(2) var<storage, read_write> further_runs: array<FurtherRuns>;
// Lists of the pixels at outlines.
@group(1) @binding(3) var<storage, read_write> outlines: array<atomic<u32>>;

// Further runs of a view.
struct FurtherRuns {
    // Arguments of a draw of the rays that found no room for all runs: one instance if there are any.
    vertices: u32,
    instances: atomic<u32>,
    first_vertex: u32,
    first_instance: u32,
    // Number of further runs.
    count: atomic<u32>,
}

// Margin for rounding: drawing may find slightly different opacities.
const OPACITY_MARGIN: f32 = 1e-3;

// Room for a further run of a view; NO_RUN if there is none.
fn further_run(view: u32) -> u32 {
    let pixels = views[view].window.end - views[view].window.first;
    let run = views[view].first_run + pixels.x * pixels.y + atomicAdd(&further_runs[view].count, 1u);
    return select(NO_RUN, run, run < views[view].end_run);
}

// Says that a ray of a view found no room for all its runs. Another draw follows the rest of such rays. Of outlines there is
// none: all pixels at outlines then keep their own rays.
fn cut_off(view: u32) {
    atomicStore(&further_runs[view].instances, 1u);
    if has_flag(views[view], OF_OUTLINES) {
        atomicStore(&outlines[views[view].first_outline], 0xffffffffu);
    }
}

@compute @workgroup_size(64)
fn march(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let view = group.z;
    let pixel = unpack_pixel(views[view].part_first) + 8u * group.xy + pixel_of_lane(lane);
    var at = run_of_pixel(views[view], pixel);
    if any(pixel >= unpack_pixel(views[view].part_end)) {
        return;
    }
    // Rays of outlines take the places of pixels.
    let first_outline = views[view].first_outline;
    let slot = outline_slot(views[view], pixel);
    let is_of_outlines = has_flag(views[view], OF_OUTLINES);
    if is_of_outlines && slot >= listed_pixels(views[view], atomicLoad(&outlines[first_outline])) {
        return;
    }
    let place = place_of_ray(views[view], pixel, atomicLoad(&outlines[first_outline + OUTLINE_HEAD + slot]));
    if at >= views[view].end_run {
        cut_off(view);
        return;
    }
    let first = at;
    let ray = ray_through(views[view], place);
    // Whether the runs behind the present place are this ray's own, of an earlier frame.
    var is_owned = has_flag(views[view], HAS_RUNS);
    var march = begin_march(ray);
    var run = no_run();
    while true {
        var behind = next_run(ray, &march, OPAQUE + OPACITY_MARGIN);
        note_lit(&behind, ray);
        let is_more = slices_of(behind) > 0u;
        // Where the run behind is stored, if there is one; the first run has its place.
        var next = at;
        if slices_of(run) > 0u {
            next = select(NO_RUN, unpack_run(runs[at]).next, is_owned);
            if next == NO_RUN && is_more {
                next = further_run(view);
                is_owned = false;
            }
            run.next = next;
            run.then = select(THEN_END, select(THEN_SAMPLES, THEN_RUN, next != NO_RUN), is_more);
            runs[at] = pack_run(run);
            at = select(at, next, is_more);
        }
        if at == NO_RUN {
            runs[first].z |= CUT_OFF;
            cut_off(view);
        }
        if !is_more && slices_of(run) > 0u || at == NO_RUN {
            break;
        }
        if behind.then != THEN_SAMPLES {
            behind.next = select(NO_RUN, unpack_run(runs[at]).next, is_owned);
            runs[at] = pack_run(behind);
            break;
        }
        run = behind;
    }
}
