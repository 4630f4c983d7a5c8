// The runs of views, for passes that read them (`runs`).
//
// The place of a sample within its step is computed as `march` does, but what is seen and where it is cut is not
// computed again. So no rounding decides what is drawn. The exception are rays whose runs found no room.

#define_import_path bevy_contextual_ao::seen

#import bevy_contextual_ao::{
    marched_view::{MarchedView, run_of_pixel},
    runs::{Run, THEN_SAMPLES, no_run, unpack_run},
}

@group(#{RUNS_BIND_GROUP}) @binding(11) var<storage, read> runs: array<vec4<u32>>;

// The first run of a pixel. It may be empty.
fn first_run(view: MarchedView, pixel: vec2<u32>) -> Run {
    return run_at(view, run_of_pixel(view, pixel));
}

// The first run at a place among the view's runs.
fn run_at(view: MarchedView, first: u32) -> Run {
    if first < view.end_run {
        return unpack_run(runs[first]);
    }
    // There was no room for any run of the ray: it is followed from its first sample.
    var run = no_run();
    run.then = THEN_SAMPLES;
    run.is_cut_off = true;
    return run;
}
