// Drawing of volumes that share space, and of parts of volumes between translucent meshes.
//
// The light of a pixel is the sum over volumes of what each of their slices adds, less what is in front of it: the slices
// of the volume itself, and those of the others. Of the others no more is asked than their transmittance up to the slice.
// So each volume is drawn by itself, whatever its grid, transfer function, method and carvers are, and its contribution
// is added to the picture. Before that, what is behind is dimmed by all volumes (`dimming.wgsl`).
//
// The Rust side is `records.rs`.

#define_import_path bevy_contextual_ao::merged

#import bevy_contextual_ao::{
    curve::{CurvesOf, NODES, UNITS, has_curve, unpack_node, word_of_curve},
    marched_view::unpack_pixel,
    view_ray::{ViewRay, depth_at},
}

// What the draw draws. Words: depths at which the drawn part begins and ends; the volume's own curves, as a `CurvesOf`; number of
// others, and the word at which their list begins.
@group(3) @binding(0) var<storage, read> record: array<u32, 8>;

// Records of all draws, then lists of other volumes, then the curves of pixels.
@group(3) @binding(1) var<storage, read> merged: array<u32>;

const CURVES_WORDS: u32 = 3u;
// Less light than this is none.
const DARK: f32 = 1e-5;

// The volume's own curves.
fn own_curves() -> CurvesOf {
    return CurvesOf(unpack_pixel(record[2]), unpack_pixel(record[3]), record[4]);
}

fn curves_at(word: u32) -> CurvesOf {
    return CurvesOf(unpack_pixel(merged[word]), unpack_pixel(merged[word + 1u]), merged[word + 2u]);
}

// Transmittance of a volume up to a depth in a pixel.
fn transmittance_to(curves: CurvesOf, pixel: vec2<u32>, depth: f32) -> f32 {
    if !has_curve(curves, pixel) {
        return 1.0;
    }
    let curve = word_of_curve(curves, pixel);
    let place = clamp((depth - bitcast<f32>(merged[curve])) / bitcast<f32>(merged[curve + 1u]), 0.0, UNITS);
    // Number of nodes that are not behind the place.
    var count = 0u;
    for (var more = 8u; more > 0u; more /= 2u) {
        let next = min(count + more, NODES);
        count = select(count, next, unpack_node(merged[curve + 1u + next]).x <= place);
    }
    let before = unpack_node(merged[curve + 1u + max(count, 1u)]);
    let behind = unpack_node(merged[curve + 2u + min(count, NODES - 1u)]);
    let way = (place - before.x) / max(behind.x - before.x, 1.0);
    let between = mix(before.y, behind.y, clamp(way, 0.0, 1.0));
    return select(select(between, before.y, count == NODES), 1.0, count == 0u);
}

// The part of a pixel's ray that is drawn, and the volumes that share its space.
struct DrawnPart {
    pixel: vec2<u32>,
    // Depths at which it begins and ends.
    begin_depth: f32,
    end_depth: f32,
    // Whether other volumes may be in the pixel. If so, its background is dimmed already.
    is_shared: bool,
    others: u32,
    first_other: u32,
    // Transmittance of the others up to the part.
    before: f32,
}

var<private> part: DrawnPart;

fn product_of_others(depth: f32) -> f32 {
    var product = 1.0;
    for (var k = 0u; k < part.others && product > DARK; k += 1u) {
        product *= transmittance_to(curves_at(part.first_other + CURVES_WORDS * k), part.pixel, depth);
    }
    return product;
}

// Begins to draw the part of the record in a pixel.
fn begin_part(pixel: vec2<u32>) {
    part.pixel = pixel;
    part.begin_depth = bitcast<f32>(record[0]);
    part.end_depth = bitcast<f32>(record[1]);
    part.is_shared = has_curve(own_curves(), pixel);
    part.others = select(0u, record[5], part.is_shared);
    part.first_other = record[6];
    part.before = product_of_others(part.begin_depth);
}

// Transmittance of the other volumes from the part's begin to a point of the ray.
fn transmittance_of_others(ray: ViewRay, along_mm: f32) -> f32 {
    return min(product_of_others(depth_at(ray, along_mm)) / max(part.before, DARK), 1.0);
}
