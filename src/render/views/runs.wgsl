// Runs: what a view ray meets. A run is a series of consecutive slices that are seen. A slice lies between two samples.
// A slice from a cut to the first sample may precede them, and the last one may end at a cut. The runs of a ray form a
// chain, nearest first. Each takes 16 bytes.

#define_import_path bevy_contextual_ao::runs

#import bevy_contextual_ao::{
    view_ray::{ViewRay, along_ray},
    volume_bindings::volume,
}

struct Run {
    // Index of the first sample, and number of slices that begin at samples.
    first: u32,
    count: u32,
    // Whether there is a slice at the cut, and the cut's distance from the ray's start, mm.
    has_cut: bool,
    cut_mm: f32,
    // Part of the last interval that is seen.
    last_part: f32,
    // Where the first and the last pair of slices are lit (`lit_slices`), steps from where the pair begins.
    first_lit: f32,
    last_lit: f32,
    // State of the sample behind the run (`next_run`).
    state: u32,
    // What is behind the run: THEN_*
    then: u32,
    // Index of the run behind it, even if it is out of use; NO_RUN if there was none yet.
    next: u32,
    // Whether the ray found no room for all its runs. The ray's first run alone says so.
    is_cut_off: bool,
}

// The ray's end; another run; samples that no run holds, from the one behind this run on; or the same, where so much is
// in front of them that they are only seen if drawing lowers opacities.
const THEN_END: u32 = 0u;
const THEN_RUN: u32 = 1u;
const THEN_SAMPLES: u32 = 2u;
const THEN_OPAQUE: u32 = 3u;

const MOST_IN_RUN: u32 = 0xfffu;
const NO_RUN: u32 = 0x3ffffffu;
const CUT_OFF: u32 = 0x4000000u;

// Units of the part of an interval, and of places where pairs are lit: 7, 12 and 12 bits of a word.
const PART_UNIT: f32 = 1.0 / 64.0;
const LIT_UNIT: f32 = 1.0 / 2047.0;

fn no_run() -> Run {
    return Run(0u, 0u, false, 0.0, 0.0, 0.0, 0.0, 0u, THEN_END, NO_RUN, false);
}

fn pack_lit(steps: f32) -> u32 {
    return u32(clamp(steps, 0.0, 2.0) / LIT_UNIT + 0.5);
}

fn pack_run(run: Run) -> vec4<u32> {
    let behind = run.next | select(0u, CUT_OFF, run.is_cut_off) | (run.state << 27u) | (run.then << 29u) | (u32(run.has_cut) << 31u);
    let places = u32(run.last_part / PART_UNIT + 0.5) | (pack_lit(run.first_lit) << 7u) | (pack_lit(run.last_lit) << 19u);
    return vec4(run.first | (run.count << 20u), bitcast<u32>(run.cut_mm), behind, places);
}

fn unpack_run(bits: vec4<u32>) -> Run {
    return Run(
        bits.x & 0xfffffu,
        bits.x >> 20u,
        (bits.z >> 31u) != 0u,
        bitcast<f32>(bits.y),
        f32(bits.w & 0x7fu) * PART_UNIT,
        f32((bits.w >> 7u) & 0xfffu) * LIT_UNIT,
        f32((bits.w >> 19u) & 0xfffu) * LIT_UNIT,
        (bits.z >> 27u) & 3u,
        (bits.z >> 29u) & 3u,
        bits.z & NO_RUN,
        (bits.z & CUT_OFF) != 0u,
    );
}

// Part of a ray. Its intensity is taken to change evenly.
struct Slice {
    // Distances of its ends from the ray's start.
    begin_mm: f32,
    end_mm: f32,
    // Length in steps: negative if the slice lies behind the ray's end.
    steps: f32,
}

fn slices_of(run: Run) -> u32 {
    return run.count + u32(run.has_cut);
}

// Slice of a run by its number, up to the ray's end.
fn slice_of_run(ray: ViewRay, run: Run, number: u32) -> Slice {
    let is_cut = run.has_cut && number == 0u;
    let i = run.first + select(number - u32(run.has_cut), 0u, is_cut);
    let along_mm = along_ray(ray, i);
    let next_mm = along_ray(ray, i + 1u);
    let is_last = i + 1u == run.first + run.count;
    let begin_mm = select(along_mm, run.cut_mm, is_cut);
    let whole_end_mm = select(select(next_mm, mix(along_mm, next_mm, run.last_part), is_last), along_mm, is_cut);
    let end_mm = min(whole_end_mm, ray.end_mm);
    return Slice(begin_mm, end_mm, (end_mm - begin_mm) / volume.draw_step_mm);
}

// Whether a run tells where a pair of its slices is lit: the first and the last one.
fn tells_place(run: Run, pair: u32) -> bool {
    return pair == 0u || 2u * pair + 2u >= slices_of(run);
}

// Where such a pair is lit, distance from the ray's start. It does not depend on the ray's end.
fn lit_place(ray: ViewRay, run: Run, pair: u32) -> f32 {
    let steps = select(run.last_lit, run.first_lit, pair == 0u);
    return slice_of_run(ray, run, 2u * pair).begin_mm + steps * volume.draw_step_mm;
}
