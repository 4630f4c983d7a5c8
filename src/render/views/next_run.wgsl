// Follows a view ray to the next run of intervals that are seen (`runs`). An interval lies between two samples, and its
// intensities are taken to change evenly: so a part of the transfer function that lies between two samples is seen.
//
// Samples are classified after interpolation. Where a ray enters or leaves a carver, the cut is found and its interval
// shortened. The paper (section 3.5, step VI) samples at steps alone. Rays leap over bricks that are known to be empty.
// Clip tests check only the carvers near a sample.
//
// A transparent interval takes one filtered sample: of a tricubic intensity, a trilinear one gives bounds.
//
// Transparent intervals, and seen intervals without a carver near, have loops of their own that do little else. A device
// runs neighbouring rays in step, and so they wait little for each other. No branch depends on uniforms alone (2 in
// docs/drivers.md).

#define_import_path bevy_contextual_ao::next_run

#import bevy_contextual_ao::{
    brick_bindings::{brick_word, carvers_near, distance_of, smoothing_of},
    bricks::{inverse_step, leap_along, samples_within},
    classification::EXTINCTIONS,
    clip_test::is_visible,
    gradients::gradient_at,
    lit_slices::intensity_at,
    preintegration::{TablePlace, at_gradient, mean_between, slice_opacity, table_place},
    reconstruction::trilinear_at_place,
    runs::{MOST_IN_RUN, NO_RUN, Run, THEN_END, THEN_SAMPLES, THEN_OPAQUE},
    view_ray::{ViewRay, along_ray, samples_of},
    volume_bindings::{may_be_visible_between, volume},
}

// A step is halved this often to find a cut. The error is less than one level of an 8-bit image.
const CUT_HALVINGS: i32 = 6;
// States of a sample: not tested, not clipped, clipped.
const UNTESTED: u32 = 0u;
const SHOWN: u32 = 1u;
const CLIPPED: u32 = 2u;

// State of following a ray.
struct March {
    // First sample of the next interval, and number of intervals.
    i: u32,
    count: u32,
    // State of this sample.
    state: u32,
    // Opacity accumulated so far.
    alpha: f32,
}

fn begin_march(ray: ViewRay) -> March {
    return March(0u, samples_of(ray), UNTESTED, 0.0);
}

// State before a run, with nothing accumulated.
fn march_before(ray: ViewRay, run: Run) -> March {
    return March(run.first - u32(run.has_cut), samples_of(ray), UNTESTED, 0.0);
}

// State behind a run that goes on with samples.
fn march_behind(ray: ViewRay, run: Run, alpha: f32) -> March {
    return March(run.first + run.count, samples_of(ray), run.state, alpha);
}

// Bounds of the intensity at the point of a ray, in a brick with this word.
fn intensity_bounds(ray: ViewRay, along_mm: f32, word: u32) -> vec2<f32> {
    let trilinear = trilinear_at_place(ray.origin + along_mm * ray.velocity);
#ifdef TRICUBIC
    return trilinear + smoothing_of(word) * vec2(-1.0, 1.0);
#else
    return vec2(trilinear);
#endif
}

// Word of the brick at the point of a ray.
fn word_at(ray: ViewRay, along_mm: f32) -> u32 {
    return brick_word(0.25 * voxel_at(ray, along_mm));
}

// Point of a ray, voxels.
fn voxel_at(ray: ViewRay, along_mm: f32) -> vec3<f32> {
    return (ray.origin + along_mm * ray.velocity) * vec3<f32>(volume.dimensions);
}

// Whether the point of a ray at a distance from `near` is not clipped.
fn is_visible_at(ray: ViewRay, along_mm: f32) -> bool {
    return is_visible(ray.near + along_mm * ray.direction, carvers_near(voxel_at(ray, along_mm)));
}

// Mean extinction of a slice between two points of a ray.
fn extinction_between(ray: ViewRay, begin_mm: f32, end_mm: f32, begin: TablePlace, end: TablePlace) -> f32 {
    let gradient = gradient_at(ray.origin + 0.5 * (begin_mm + end_mm) * ray.velocity);
    return mean_between(at_gradient(begin, EXTINCTIONS, gradient), at_gradient(end, EXTINCTIONS, gradient));
}

// Accumulated opacity with another slice behind.
fn alpha_behind(alpha: f32, extinction: f32, steps: f32) -> f32 {
    return alpha + (1.0 - alpha) * slice_opacity(extinction, steps);
}

// The next run of a ray. It is empty at the ray's end. It ends where the accumulated opacity reaches `most_alpha`, and
// then may go on.
fn next_run(ray: ViewRay, march: ptr<function, March>, most_alpha: f32) -> Run {
    let step_mm = volume.draw_step_mm;
    let leap = leap_along(inverse_step(step_mm * ray.velocity * vec3<f32>(volume.dimensions)));
    let count = (*march).count;
    var i = (*march).i;
    var state = (*march).state;
    var alpha = (*march).alpha;
    var run = Run(i, 0u, false, 0.0, 1.0, 0.0, 0.0, UNTESTED, THEN_END, NO_RUN, false);
    // Of both ends of the interval: words of their bricks, bounds of their intensities, and intensities. Those of the first
    // end are only known if `is_known`.
    var word = word_at(ray, along_ray(ray, i));
    var word_behind = word;
    var bounds = intensity_bounds(ray, along_ray(ray, i), word);
    var bounds_behind = bounds;
    var before = 0.0;
    var behind = 0.0;
    var is_known = false;
    // Places of both in the table.
    var place: TablePlace;
    var place_behind: TablePlace;
    // Whether a leap ended at the interval's first sample: then the interval leads out of an empty brick.
    var has_leapt = false;
    var is_open = false;
    var is_done = false;
    while !is_done {
        // Passes over transparent intervals.
        while !is_open && i < count {
            let point = 0.25 * voxel_at(ray, along_ray(ray, i));
            let distance = select(distance_of(word) * volume.draw_leaps, 0u, has_leapt);
            has_leapt = distance > 0u;
            // The last sample in empty bricks begins the interval that leads out of them.
            let passed = select(1u, min(count - i, samples_within(point, leap, distance)), has_leapt);
            let next = i + passed - u32(has_leapt);
            let next_mm = along_ray(ray, next);
            word_behind = word_at(ray, next_mm);
            bounds_behind = intensity_bounds(ray, next_mm, word_behind);
            let low = min(bounds.x, bounds_behind.x);
            let high = max(bounds.y, bounds_behind.y);
            if !has_leapt && may_be_visible_between(low, high) {
                break;
            }
            state = select(state, UNTESTED, next > i);
            is_known &= next == i;
            word = word_behind;
            bounds = bounds_behind;
            i = next;
        }
        if !is_open && i < count {
#ifdef TRICUBIC
            if !is_known {
                before = intensity_at(ray, along_ray(ray, i));
            }
            behind = intensity_at(ray, along_ray(ray, i + 1u));
            if !may_be_visible_between(before, behind) {
                state = UNTESTED;
                is_known = true;
                word = word_behind;
                bounds = vec2(behind);
                before = behind;
                i += 1u;
                continue;
            }
#else
            before = bounds.x;
            behind = bounds_behind.x;
#endif
            place = table_place(before, EXTINCTIONS, 0.0);
            place_behind = table_place(behind, EXTINCTIONS, 0.0);
        }
        // Adds seen intervals without a carver near.
        while is_open && i < count && run.count < MOST_IN_RUN && alpha < most_alpha {
            let end_mm = along_ray(ray, i + 1u);
            behind = intensity_at(ray, end_mm);
            place_behind = table_place(behind, EXTINCTIONS, 0.0);
            let extinction = extinction_between(ray, along_ray(ray, i), end_mm, place, place_behind);
            if extinction <= 0.0 || carvers_near(voxel_at(ray, end_mm)) != 0u {
                break;
            }
            alpha = alpha_behind(alpha, extinction, 1.0);
            place = place_behind;
            run.count += 1u;
            run.last_part = 1.0;
            i += 1u;
        }
        if i >= count || run.count == MOST_IN_RUN || alpha >= most_alpha {
            break;
        }
        let begin_mm = along_ray(ray, i);
        let end_mm = along_ray(ray, i + 1u);
        // Tests whether both ends are clipped. Where one is, halving finds the cut: the visible point nearest to the
        // carver's surface.
        var state_behind = UNTESTED;
        var visible_mm = begin_mm;
        var clipped_mm = end_mm;
        var point_mm = select(end_mm, begin_mm, state == UNTESTED);
        for (var k = select(1, 0, state == UNTESTED); k <= CUT_HALVINGS + 1; k += 1) {
            let is_shown = is_visible_at(ray, point_mm);
            if k == 0 {
                state = select(CLIPPED, SHOWN, is_shown);
                point_mm = end_mm;
                continue;
            }
            if k == 1 {
                state_behind = select(CLIPPED, SHOWN, is_shown);
                if state == state_behind {
                    break;
                }
                visible_mm = select(begin_mm, end_mm, is_shown);
                clipped_mm = select(end_mm, begin_mm, is_shown);
            } else if is_shown {
                visible_mm = point_mm;
            } else {
                clipped_mm = point_mm;
            }
            point_mm = 0.5 * (visible_mm + clipped_mm);
        }
        // The intensity at a cut takes the place of that at the clipped end.
        let enters = state == CLIPPED && state_behind == SHOWN;
        let leaves = state == SHOWN && state_behind == CLIPPED;
        var first = place;
        var last = place_behind;
        if enters || leaves {
            let cut = table_place(intensity_at(ray, visible_mm), EXTINCTIONS, 0.0);
            if enters {
                first = cut;
            } else {
                last = cut;
            }
        }
        let first_mm = select(begin_mm, visible_mm, enters);
        let last_mm = select(end_mm, visible_mm, leaves);
        let extinction = extinction_between(ray, first_mm, last_mm, first, last);
        let is_seen = (state == SHOWN || enters) && extinction > 0.0;
        if is_seen {
            // A run begins at a cut, or at a sample.
            run.has_cut = select(run.has_cut, enters, !is_open);
            run.cut_mm = select(run.cut_mm, visible_mm, enters);
            run.first = select(run.first, i + u32(enters), !is_open);
            run.count += u32(!enters);
            run.last_part = select(1.0, (visible_mm - begin_mm) / (end_mm - begin_mm), leaves);
            alpha = alpha_behind(alpha, extinction, (last_mm - first_mm) / step_mm);
        }
        is_done = is_open && !is_seen || is_seen && leaves;
        is_open = is_seen && !leaves;
        // The sample behind a run that ends at a transparent interval is the interval's first.
        run.state = select(state_behind, state, is_done && !is_seen);
        state = state_behind;
        is_known = true;
        word = word_at(ray, end_mm);
        bounds = vec2(behind);
        before = behind;
        place = place_behind;
        i += 1u;
    }
    let goes_on = select(THEN_SAMPLES, THEN_OPAQUE, alpha >= most_alpha);
    run.then = select(goes_on, THEN_END, i >= count);
    (*march).i = i;
    (*march).state = state;
    (*march).alpha = alpha;
    return run;
}
