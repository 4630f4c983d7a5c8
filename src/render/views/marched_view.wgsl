// A view of a volume: its window, and where its runs are stored. The Rust side is `MarchedViewUniform`.
//
// Passes over several views have them in a uniform array, and know theirs by the workgroup. A software driver loads a
// view from there once for all lanes, but from a storage buffer for each lane: a third of the march.

#define_import_path bevy_contextual_ao::marched_view

#import bevy_contextual_ao::window::Window

// Views in one dispatch.
const VIEWS: u32 = 16u;

struct MarchedView {
    window: Window,
    // Volume space (mm) → clip space.
    clip_from_local: mat4x4<f32>,
    // First and end pixel of the part to be marched in this frame.
    part_first: vec2<u32>,
    part_end: vec2<u32>,
    // Index of the first run of the window's first pixel, and the end of the room for runs. Further runs of pixels follow
    // the first runs of all.
    first_run: u32,
    end_run: u32,
    // 1: the runs of an earlier frame are there.
    has_runs: u32,
    // 1: the view shows the volume mirrored.
    is_mirrored: u32,
}

// Index of the first run of a pixel in the window.
fn run_of_pixel(view: MarchedView, pixel: vec2<u32>) -> u32 {
    let place = pixel - view.window.first;
    return view.first_run + place.y * (view.window.end.x - view.window.first.x) + place.x;
}
