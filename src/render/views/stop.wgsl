// The point of a view ray up to which a share of its light is stopped. It has a depth, where a volume as a whole has none:
// for depths, motion vectors and shadow maps.

#define_import_path bevy_contextual_ao::stop

#import bevy_contextual_ao::{
    next_run::{March, march_before, next_run},
    runs::{Run, THEN_END, slice_of_run, slices_of},
    view_ray::ViewRay,
}

struct Stop {
    // Distance from the ray's start: the middle of a slice.
    along_mm: f32,
    // Opacity up to there. If it is less than was asked for, the rest of the ray is empty.
    alpha: f32,
}

// The point up to which the opacity adds up to `most_alpha`, or the last one that is seen, from a state of following the ray on.
fn stop_of(ray: ViewRay, from_here: March, most_alpha: f32) -> Stop {
    var march = from_here;
    var last: Run;
    var is_more = true;
    while is_more && march.alpha < most_alpha {
        let run = next_run(ray, &march, most_alpha);
        is_more = slices_of(run) > 0u;
        if is_more {
            last = run;
        }
        is_more &= run.then != THEN_END;
    }
    let slice = slice_of_run(ray, last, max(slices_of(last), 1u) - 1u);
    return Stop(0.5 * (slice.begin_mm + slice.end_mm), march.alpha);
}

// The same for the ray of a pixel, whose first run is known: what the march found in front of it is empty. A ray whose runs
// found no room is followed from its start.
fn stop_behind_first_run(ray: ViewRay, first: Run, most_alpha: f32) -> Stop {
    var march = march_before(ray, first);
    // An empty ray is not followed.
    march.count = select(0u, march.count, slices_of(first) > 0u || first.then != THEN_END);
    return stop_of(ray, march, most_alpha);
}
