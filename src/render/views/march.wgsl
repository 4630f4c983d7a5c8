// Follows the view rays of a volume once, for all views at the same time, and stores each ray's runs (`runs`).
// Occlusion is then computed where the runs read it, and drawing shades the runs: neither follows a ray again. Samples
// that opaque meshes will hide are not known yet: somewhat more is found than is drawn, never less.

#import bevy_contextual_ao::{
    marched_view::{MarchedView, VIEWS, run_of_pixel},
    next_run::{begin_march, next_run},
    runs::{CUT_OFF, NO_RUN, THEN_END, THEN_RUN, THEN_SAMPLES, no_run, pack_run, slices_of, unpack_run},
    view_ray::{OPAQUE, view_ray},
    window::pixel_of_lane,
}

@group(1) @binding(0) var<uniform> views: array<MarchedView, VIEWS>;
@group(1) @binding(1) var<storage, read_write> runs: array<vec4<u32>>;
// Number of further runs of each view.
@group(1) @binding(2) var<storage, read_write> further_runs: array<FurtherRuns>;

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

@compute @workgroup_size(64)
fn march(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let view = group.z;
    let pixel = views[view].part_first + 8u * group.xy + pixel_of_lane(lane);
    var at = run_of_pixel(views[view], pixel);
    if any(pixel >= views[view].part_end) {
        return;
    }
    if at >= views[view].end_run {
        atomicStore(&further_runs[view].instances, 1u);
        return;
    }
    let first = at;
    let window = views[view].window;
    let ray = view_ray(vec2<f32>(pixel) + 0.5, window.viewport, window.view_from_clip, window.world_from_view);
    // Whether the runs behind the present place are this ray's own, of an earlier frame.
    var is_owned = views[view].has_runs != 0u;
    var march = begin_march(ray);
    var run = no_run();
    while true {
        var behind = next_run(ray, &march, OPAQUE + OPACITY_MARGIN);
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
            atomicStore(&further_runs[view].instances, 1u);
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
