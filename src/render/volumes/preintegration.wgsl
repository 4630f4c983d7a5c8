// Mean extinction and colour of a slice whose intensity changes evenly from one end to the other: pre-integrated
// classification (Lum, Wilson and Ma 2004). It finds parts of the transfer function that lie between two samples.
//
// Rows of the table hold extinction per opacity unit distance, and its integral over entries. So a mean takes the same
// few loads however far the ends lie apart. The Rust side is `preintegration.rs`.

#define_import_path bevy_contextual_ao::preintegration

#import bevy_contextual_ao::volume_bindings::{lookup_entry, lookup_table, volume}

// Rows of the table: extinction times colour, and extinction; the integral of both up to an entry; and how much the
// integral is more than that, because its 32 bits keep too few digits.
const EXTINCTION_ROW: u32 = 3u;
const INTEGRAL_ROW: u32 = 4u;
const INTEGRAL_REST_ROW: u32 = 5u;
// Opacity of an occlusion step at an entry, and its integral and rest.
const OCCLUSION_ROW: u32 = 6u;

// Entries closer than this are one: their difference has too few digits.
const SAME: f32 = 1e-3;

// An intensity's place in the table, with the rows there. Beyond the table the function is constant.
struct TablePlace {
    entry: f32,
    // Entry at or before it, its distance from there, and how far it lies beyond the table.
    below: f32,
    part: f32,
    outside: f32,
    integral: vec4<f32>,
    rest: vec4<f32>,
    extinction: vec4<f32>,
    extinction_above: vec4<f32>,
}

fn table_place(intensity: f32) -> TablePlace {
    let last = f32(textureDimensions(lookup_table).x - 1u);
    let entry = lookup_entry(intensity);
    let inside = clamp(entry, 0.0, last);
    let below = min(floor(inside), last - 1.0);
    let k = u32(below);
    return TablePlace(
        entry,
        below,
        inside - below,
        entry - inside,
        textureLoad(lookup_table, vec2(k, INTEGRAL_ROW), 0),
        textureLoad(lookup_table, vec2(k, INTEGRAL_REST_ROW), 0),
        textureLoad(lookup_table, vec2(k, EXTINCTION_ROW), 0),
        textureLoad(lookup_table, vec2(k + 1u, EXTINCTION_ROW), 0),
    );
}

// Integral from the entry below to the place itself.
fn integral_from_below(place: TablePlace) -> vec4<f32> {
    let within = place.part * mix(place.extinction, place.extinction_above, 0.5 * place.part);
    return within + place.outside * select(place.extinction, place.extinction_above, place.outside > 0.0);
}

// Extinction times colour, and extinction, per opacity unit distance: the means over intensities between two.
fn extinction_between(a: TablePlace, b: TablePlace) -> vec4<f32> {
    let span = b.entry - a.entry;
    let whole = (b.integral - a.integral) + (b.rest - a.rest);
    let integral = whole + (integral_from_below(b) - integral_from_below(a));
    // Between two entries the extinction is linear.
    let middle = mix(a.extinction, a.extinction_above, a.part + 0.5 * (b.part - a.part));
    let is_between_two = a.below == b.below && a.outside == 0.0 && b.outside == 0.0;
    let is_one = is_between_two || abs(span) < SAME;
    return max(select(integral / select(span, 1.0, is_one), middle, is_one), vec4(0.0));
}

// Opacity of a slice of mean extinction, `steps` drawing steps long.
fn slice_opacity(extinction: f32, steps: f32) -> f32 {
    return 1.0 - exp(-extinction * steps * volume.draw_exponent);
}

// Mean opacity of an occlusion step over an even distribution of intensities between two.
fn occlusion_opacity_between(low: f32, high: f32) -> f32 {
    let last = f32(textureDimensions(lookup_table).x - 1u);
    let ends = vec2(lookup_entry(low), lookup_entry(high));
    let inside = clamp(ends, vec2(0.0), vec2(last));
    let below = min(floor(inside), vec2(last - 1.0));
    let k = vec2<u32>(below);
    let a = textureLoad(lookup_table, vec2(k.x, OCCLUSION_ROW), 0);
    let b = textureLoad(lookup_table, vec2(k.y, OCCLUSION_ROW), 0);
    let opacity = vec2(a.x, b.x);
    let above = vec2(
        textureLoad(lookup_table, vec2(k.x + 1u, OCCLUSION_ROW), 0).x,
        textureLoad(lookup_table, vec2(k.y + 1u, OCCLUSION_ROW), 0).x,
    );
    let part = inside - below;
    let outside = ends - inside;
    let within = part * mix(opacity, above, 0.5 * part) + outside * select(opacity, above, outside > vec2(0.0));
    let span = ends.y - ends.x;
    let integral = ((b.y - a.y) + (b.z - a.z)) + (within.y - within.x);
    let middle = mix(opacity.x, above.x, part.x + 0.5 * (part.y - part.x));
    let is_one = k.x == k.y && all(outside == vec2(0.0)) || span < SAME;
    return saturate(select(integral / select(span, 1.0, is_one), middle, is_one));
}
