// Follows a view ray to the next run of samples that are seen (`runs`).
//
// Samples are classified after interpolation. Where a ray enters or leaves a carver, the cut is found
// and sampled. The paper (section 3.5, step VI) samples at steps alone. Rays leap over bricks that
// are known to be empty. Clip tests check only the carvers near a sample.
//
// Transparent samples, and visible samples without a carver near, have loops of their own that do little else. A device
// runs neighbouring rays in step, and so they wait little for each other. No branch depends on uniforms alone (2 in
// docs/drivers.md).

#define_import_path bevy_contextual_ao::next_run

#import bevy_contextual_ao::{
    brick_bindings::{carvers_near, distance_at},
    bricks::{inverse_step, leap_along, samples_within},
    clip_test::is_visible,
    runs::{MOST_IN_RUN, NO_RUN, Run, THEN_END, THEN_SAMPLES, THEN_OPAQUE},
    view_ray::{ViewRay, along_ray, samples_of},
    volume_bindings::{
        correct_opacity, edge_sampler, intensities, may_be_visible, opacity_of_intensity, volume,
    },
}

// A step is halved this often to find a cut. The error is less than one level of an 8-bit image.
const CUT_HALVINGS: i32 = 6;
// States of a sample: transparent; not transparent; not transparent but clipped.
const EMPTY: u32 = 0u;
const VISIBLE: u32 = 1u;
const CLIPPED: u32 = 2u;
// Transparent or clipped.
const UNSEEN: u32 = 3u;

// State of following a ray.
struct March {
    // Next sample, and number of samples.
    i: u32,
    count: u32,
    // State of the sample before. If it is visible, the next run begins with it.
    before: u32,
    // Opacity accumulated so far, without the sample before.
    alpha: f32,
}

fn begin_march(ray: ViewRay) -> March {
    return March(0u, samples_of(ray), EMPTY, 0.0);
}

// State behind a run that goes on with samples.
fn march_behind(ray: ViewRay, run: Run, alpha: f32) -> March {
    let behind = run.first + run.count;
    let count = samples_of(ray);
    return March(behind + 1u, count, select(EMPTY, run.state, behind < count), alpha);
}

fn intensity_at(ray: ViewRay, along_mm: f32) -> f32 {
    return textureSampleLevel(intensities, edge_sampler, ray.origin + along_mm * ray.velocity, 0.0).r;
}

fn opacity_at(ray: ViewRay, along_mm: f32) -> f32 {
    return opacity_of_intensity(intensity_at(ray, along_mm));
}

// Point of a ray, voxels.
fn voxel_at(ray: ViewRay, along_mm: f32) -> vec3<f32> {
    return (ray.origin + along_mm * ray.velocity) * vec3<f32>(volume.dimensions);
}

// Whether the point of a ray at a distance from `near` is not clipped.
fn is_visible_at(ray: ViewRay, along_mm: f32) -> bool {
    return is_visible(ray.near + along_mm * ray.direction, carvers_near(voxel_at(ray, along_mm)));
}

// Accumulated opacity with another slice behind.
fn alpha_behind(alpha: f32, opacity: f32, steps: f32) -> f32 {
    let sum = alpha + (1.0 - alpha) * correct_opacity(opacity, steps * volume.draw_exponent);
    return select(alpha, sum, steps > 0.0);
}

// The next run of a ray. It is empty at the ray's end. It ends where the accumulated opacity reaches `most_alpha`, and
// then may go on.
fn next_run(ray: ViewRay, march: ptr<function, March>, most_alpha: f32) -> Run {
    let step_mm = volume.draw_step_mm;
    let leap = leap_along(inverse_step(step_mm * ray.velocity * vec3<f32>(volume.dimensions)));
    let count = (*march).count;
    var i = (*march).i;
    var before = (*march).before;
    var alpha = (*march).alpha;
    // Whether the run has begun. Then the sample before is visible, and its slice is still to be added.
    var is_open = before == VISIBLE;
    var run = Run(i - u32(is_open), 0u, false, 0.0, 1.0, EMPTY, THEN_END, NO_RUN, false);
    var opacity = opacity_at(ray, along_ray(ray, run.first));
    var is_done = false;
    while !is_done {
        // Passes over transparent samples.
        while !is_open && i < count {
            let along_mm = along_ray(ray, i);
            let point = 0.25 * voxel_at(ray, along_mm);
            let distance = distance_at(point) * volume.draw_leaps;
            // Leaps over empty bricks. It is looked up later whether the last sample in them is clipped.
            i += select(0u, min(count - i, samples_within(point, leap, distance)), distance > 0u);
            before = select(before, UNSEEN, distance > 0u);
            if may_be_visible(intensity_at(ray, along_ray(ray, i))) {
                break;
            }
            before = EMPTY;
            i += 1u;
        }
        // Adds visible samples without a carver near.
        while is_open && i < count && run.count < MOST_IN_RUN && alpha < most_alpha {
            let along_mm = along_ray(ray, i);
            let next_opacity = opacity_at(ray, along_mm);
            if next_opacity <= 0.0 || carvers_near(voxel_at(ray, along_mm)) != 0u {
                break;
            }
            alpha = alpha_behind(alpha, opacity, 1.0);
            opacity = next_opacity;
            run.count += 1u;
            i += 1u;
        }
        if run.count == MOST_IN_RUN || alpha >= most_alpha {
            break;
        }
        let is_end = i >= count;
        let along_mm = along_ray(ray, i);
        let next_opacity = select(opacity_at(ray, along_mm), 0.0, is_end);
        let was_clipped = before == CLIPPED || before == UNSEEN && opacity_at(ray, along_mm - step_mm) > 0.0;
        // Tests whether the sample is clipped. Where the ray crosses a carver's surface, halving finds the cut:
        // the visible point nearest to the surface.
        var now = EMPTY;
        var enters = false;
        var leaves = false;
        var visible_mm = along_mm;
        var clipped_mm = along_mm;
        var point_mm = along_mm;
        for (var k = 0; k <= CUT_HALVINGS; k += 1) {
            let is_shown = is_visible_at(ray, point_mm);
            if k == 0 {
                now = select(EMPTY, select(CLIPPED, VISIBLE, is_shown), next_opacity > 0.0);
                enters = was_clipped && now == VISIBLE;
                leaves = is_open && now == CLIPPED;
                visible_mm -= select(0.0, step_mm, leaves);
                clipped_mm -= select(0.0, step_mm, enters);
            } else if is_shown {
                visible_mm = point_mm;
            } else {
                clipped_mm = point_mm;
            }
            if !enters && !leaves {
                break;
            }
            point_mm = 0.5 * (visible_mm + clipped_mm);
        }
        if is_open {
            // The sample before stands for the step from there to here, up to the cut if there is one.
            run.last_steps = 1.0 + select(0.0, (visible_mm - along_mm) / step_mm, leaves);
            run.count += 1u;
            alpha = alpha_behind(alpha, opacity, run.last_steps);
            is_done = now != VISIBLE;
        } else if now == VISIBLE {
            run.first = i;
            // The rest of the step is sampled at the cut. So surfaces of cuts do not jump when a carver moves by
            // less than a step. They are as smooth as the carver.
            run.has_cut = enters;
            run.cut_mm = visible_mm;
            let cut_steps = (along_mm - visible_mm) / step_mm;
            alpha = select(alpha, alpha_behind(alpha, opacity_at(ray, visible_mm), cut_steps), enters);
        }
        is_open = now == VISIBLE;
        is_done |= is_end;
        before = now;
        opacity = next_opacity;
        i += u32(!is_end);
    }
    run.state = before;
    let goes_on = select(THEN_SAMPLES, THEN_OPAQUE, alpha >= most_alpha);
    run.then = select(goes_on, THEN_END, i >= count && !is_open);
    (*march).i = i;
    (*march).before = before;
    (*march).alpha = alpha;
    return run;
}
