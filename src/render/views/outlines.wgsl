// Finds the pixels at outlines in multisampled views: where neighbouring rays meet surfaces that do not go on in each
// other. Such a pixel is listed. Several rays, which are marched next, then take the place of the pixel's own ray. If the
// list has no room for all pixels, all keep their own ray.

#import bevy_contextual_ao::{
    marched_view::{
        MarchedView, NOT_LISTED, NO_COLOR, OUTLINE_HEAD, VIEWS, ray_through, run_of_pixel, word_of_color, word_of_slot,
    },
    runs::{THEN_RUN, slices_of, unpack_run},
    view_ray::{ViewRay, along_ray},
    volume_bindings::volume,
    window::pixel_of_lane,
}

@group(1) @binding(0) var<uniform> views: array<MarchedView, VIEWS>;
@group(1) @binding(1) var<storage, read> runs: array<vec4<u32>>;
@group(1) @binding(3) var<storage, read_write> outlines: array<atomic<u32>>;

// Bend between three neighbouring rays from which on a surface does not go on, voxels and widths of a pixel.
const BEND: f32 = 2.0;
// Number of runs of a ray that are searched for cuts.
const RUNS: i32 = 3;

// Where a ray first meets the volume.
struct Meeting {
    along_mm: f32,
    // Whether it meets anything, and whether it soon meets a cut.
    is_there: bool,
    is_cut: bool,
}

fn ray_of(view: u32, pixel: vec2<u32>) -> ViewRay {
    return ray_through(views[view], vec2<f32>(pixel) + 0.5);
}

fn meeting_at(view: u32, pixel: vec2<u32>) -> Meeting {
    let inside = clamp(pixel, views[view].window.first, views[view].window.end - 1u);
    var run = unpack_run(runs[run_of_pixel(views[view], inside)]);
    let along_mm = select(along_ray(ray_of(view, inside), run.first), run.cut_mm, run.has_cut);
    var meeting = Meeting(along_mm, slices_of(run) > 0u, run.has_cut);
    // At the rim of a cut, a sliver may be in front of it.
    for (var k = 1; k < RUNS && run.then == THEN_RUN && !meeting.is_cut; k += 1) {
        run = unpack_run(runs[run.next]);
        meeting.is_cut = run.has_cut;
    }
    return meeting;
}

fn differs(a: Meeting, b: Meeting) -> bool {
    return a.is_there != b.is_there || a.is_cut != b.is_cut;
}

@compute @workgroup_size(64)
fn find_outlines(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let view = group.z;
    let window = views[view].window;
    let pixel = window.first + 8u * group.xy + pixel_of_lane(lane);
    if any(pixel >= window.end) || run_of_pixel(views[view], window.end - 1u) >= views[view].end_run {
        return;
    }
    let here = meeting_at(view, pixel);
    let left = meeting_at(view, pixel - vec2(1u, 0u));
    let right = meeting_at(view, pixel + vec2(1u, 0u));
    let above = meeting_at(view, pixel - vec2(0u, 1u));
    let below = meeting_at(view, pixel + vec2(0u, 1u));
    var is_outline = differs(here, left) || differs(here, right) || differs(here, above) || differs(here, below);
    if here.is_there {
        // A plane bends nowhere, however it lies. Starts of rays differ by up to a step.
        let bends = abs(vec2(left.along_mm + right.along_mm, above.along_mm + below.along_mm) - 2.0 * here.along_mm);
        let ray = ray_of(view, pixel);
        let beside = ray_of(view, pixel + vec2(1u, 0u));
        let offset = (beside.near - ray.near) + here.along_mm * (beside.direction - ray.direction);
        let least = BEND * max(volume.voxel_mm, length(offset)) + 2.0 * volume.draw_step_mm;
        is_outline |= max(bends.x, bends.y) > least;
    }
    var listed_at = NOT_LISTED;
    if is_outline {
        let first = views[view].first_outline;
        let slot = atomicAdd(&outlines[first], 1u);
        if slot < views[view].most_outlines {
            atomicStore(&outlines[first + OUTLINE_HEAD + slot], pixel.x | (pixel.y << 16u));
            atomicStore(&outlines[word_of_color(views[view], slot) + 2u], bitcast<u32>(NO_COLOR));
            listed_at = slot;
        }
    }
    if views[view].most_outlines > 0u {
        atomicStore(&outlines[word_of_slot(views[view], pixel)], listed_at);
    }
}
