// What slices of a view ray add to a pixel, and where they are lit. A slice lies between two samples (`runs`). Its
// intensities are taken to change evenly from one end to the other.
//
// Light varies less along a ray than opacity and colour do: so two successive slices share the light of one place.

#define_import_path bevy_contextual_ao::lit_slices

#import bevy_contextual_ao::{
    classification::EXTINCTIONS,
    gradients::gradient_at,
    preintegration::{TablePlace, at_gradient, mean_between, slice_opacity, table_place, value_at},
    reconstruction::intensity_at_place,
    runs::{Run, Slice, slice_of_run, slices_of},
    view_ray::ViewRay,
    volume_bindings::volume,
}

// Slices of less opacity are shaded in their middle.
const THIN: f32 = 0.1;
// A difference of extinctions that counts as none, as a share of them.
const EVEN: f32 = 1e-3;
// A slice with a peak is halved this often.
const PLACE_HALVINGS: i32 = 5;

// An end of a slice, for a gradient.
struct SliceEnd {
    intensity: f32,
    gradient: f32,
    place: TablePlace,
}

fn end_of_intensity(intensity: f32) -> SliceEnd {
    return SliceEnd(intensity, 0.0, table_place(intensity, EXTINCTIONS, 0.0));
}

fn intensity_at(ray: ViewRay, along_mm: f32) -> f32 {
    return intensity_at_place(ray.origin + along_mm * ray.velocity);
}

fn end_at(ray: ViewRay, along_mm: f32) -> SliceEnd {
    return end_of_intensity(intensity_at(ray, along_mm));
}

fn end_at_gradient(end: SliceEnd, gradient: f32) -> SliceEnd {
    return SliceEnd(end.intensity, gradient, at_gradient(end.place, EXTINCTIONS, gradient));
}

// Middle of a slice, texture coordinates.
fn middle_of(ray: ViewRay, slice: Slice) -> vec3<f32> {
    return ray.origin + 0.5 * (slice.begin_mm + slice.end_mm) * ray.velocity;
}

// Place in the table of a part of a slice.
fn place_between(first: SliceEnd, last: SliceEnd, part: f32) -> TablePlace {
    return table_place(mix(first.intensity, last.intensity, part), EXTINCTIONS, first.gradient);
}

// The part of a slice in front of the place up to which extinction adds up to `half`; `mean` is that of the slice.
fn place_of_half(first: SliceEnd, last: SliceEnd, mean: f32, half: f32) -> f32 {
    let before = value_at(first.place);
    let behind = value_at(last.place);
    let tolerance = EVEN * mean;
    // In a slice with a peak or a valley, the place is found by halving. Else a jump of extinction, as at a surface, gives
    // a first guess, and a step by Newton's method mends it. A device runs neighbouring rays in step: so both share a loop.
    let is_even = min(before, behind) <= mean + tolerance && max(before, behind) >= mean - tolerance;
    let change = behind - before;
    let jump = saturate(select((behind - mean) / change, 0.0, abs(change) < tolerance));
    let in_front = before * jump;
    let guess = saturate(select(jump + (half - in_front) / behind, half / before, half < in_front));
    var near = 0.0;
    var far = 1.0;
    var part = select(0.5, guess, is_even);
    for (var k = select(0, PLACE_HALVINGS - 1, is_even); k < PLACE_HALVINGS; k += 1) {
        let place = place_between(first, last, part);
        let depth = part * mean_between(first.place, place);
        near = select(near, part, depth < half);
        far = select(part, far, depth < half);
        let mended = saturate(part + (half - depth) / max(value_at(place), 0.25 * mean));
        part = select(0.5 * (near + far), mended, is_even);
    }
    return part;
}

// What a slice adds to a pixel.
struct SeenSlice {
    // Opacity, less what is in front of it.
    opacity: f32,
    // The place that has half of the slice's opacity in front: its distance from the ray's start, and what is there.
    along_mm: f32,
    intensity: f32,
    gradient: f32,
}

const NOTHING_SEEN: SeenSlice = SeenSlice(0.0, 0.0, 0.0, 0.0);

// What a slice adds behind an accumulated opacity. `share` is a factor on the opacity of a unit distance.
fn seen_slice(ray: ViewRay, slice: Slice, begin: SliceEnd, end: SliceEnd, alpha: f32, share: f32) -> SeenSlice {
    let gradient = gradient_at(middle_of(ray, slice));
    let first = end_at_gradient(begin, gradient);
    let last = end_at_gradient(end, gradient);
    let mean = mean_between(first.place, last.place);
    // A whole share changes no bit.
    let modulated = -log((1.0 - share) + share * exp(-mean));
    let extinction = select(modulated, mean, share > 0.9999);
    let slice_alpha = slice_opacity(extinction, max(slice.steps, 0.0));
    var part = 0.5;
    if slice_alpha > THIN {
        // Half of the opacity lies in front.
        let half = -log(1.0 - 0.5 * slice_alpha) / (extinction * slice.steps * volume.draw_exponent);
        part = place_of_half(first, last, mean, half * mean);
    }
    let intensity = mix(first.intensity, last.intensity, part);
    return SeenSlice((1.0 - alpha) * slice_alpha, mix(slice.begin_mm, slice.end_mm, part), intensity, gradient);
}

// Two successive slices of a run: those numbered 2n and 2n + 1. The run's last pair may lack the second.
struct SeenPair {
    near: SeenSlice,
    far: SeenSlice,
    // Share of the second in what both add.
    share: f32,
}

fn pair_of(near: SeenSlice, far: SeenSlice) -> SeenPair {
    return SeenPair(near, far, far.opacity / max(near.opacity + far.opacity, 1e-30));
}

// Where a pair is lit: in the middle of what it adds. Distance from the ray's start.
fn lit_mm(pair: SeenPair) -> f32 {
    return mix(pair.near.along_mm, pair.far.along_mm, pair.share);
}

// Notes in a run where its first and its last pair are lit.
fn note_lit(run: ptr<function, Run>, ray: ViewRay) {
    let slices = slices_of(*run);
    let last = max(slices, 1u) - 1u;
    var k = 0u;
    while k < slices {
        let first = slice_of_run(ray, *run, k);
        let middle = end_at(ray, first.end_mm);
        let near = seen_slice(ray, first, end_at(ray, first.begin_mm), middle, 0.0, 1.0);
        var far = NOTHING_SEEN;
        if k < last {
            let second = slice_of_run(ray, *run, k + 1u);
            far = seen_slice(ray, second, middle, end_at(ray, second.end_mm), near.opacity, 1.0);
        }
        (*run).last_lit = (lit_mm(pair_of(near, far)) - first.begin_mm) / volume.draw_step_mm;
        (*run).first_lit = select((*run).first_lit, (*run).last_lit, k == 0u);
        k = select(slices, last & ~1u, k < (last & ~1u));
    }
}
