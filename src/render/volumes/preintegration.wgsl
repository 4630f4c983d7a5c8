// Means of a function of the intensity over a range of intensities: pre-integrated classification (Lum, Wilson and Ma
// 2004). In a slice whose intensity changes evenly from one end to the other, the mean of the extinction tells the
// slice's opacity. It finds parts of the transfer function that lie between two samples.
//
// A row of the table holds a function and its integral over entries. So a mean takes the same two loads however far the
// ends lie apart. The gradient counts as constant in a slice. The Rust side is `preintegration.rs`.

#define_import_path bevy_contextual_ao::preintegration

#import bevy_contextual_ao::{
    classification::table_entry,
    volume_bindings::{lookup_entry, lookup_table, volume},
}

// Entries closer than this are one: their difference has too few digits.
const SAME: f32 = 1e-3;

// An intensity's place in a row. Beyond the table the function is constant.
struct TablePlace {
    entry: f32,
    // Entry at or before it, its distance from there, and how far it lies beyond the table.
    below: f32,
    part: f32,
    outside: f32,
    // The function at this entry and at the next one; the integral up to this entry, and how much it is more than that,
    // because its 32 bits keep too few digits.
    row: vec4<f32>,
}

// The place in a kind of row for a gradient.
fn table_place(intensity: f32, kind: u32, gradient: f32) -> TablePlace {
    let last = f32(textureDimensions(lookup_table).x - 1u);
    let entry = lookup_entry(intensity);
    let inside = clamp(entry, 0.0, last);
    let below = min(floor(inside), last - 1.0);
    let values = table_entry(u32(below), kind, gradient);
    return TablePlace(entry, below, inside - below, entry - inside, values);
}

// A place for gradient 0, for another gradient.
fn at_gradient(place: TablePlace, kind: u32, gradient: f32) -> TablePlace {
    var moved = place;
#ifdef BY_GRADIENT
    moved.row = table_entry(u32(place.below), kind, gradient);
#endif
    return moved;
}

// The function at a place.
fn value_at(place: TablePlace) -> f32 {
    return mix(place.row.x, place.row.y, place.part);
}

// Integral from the entry below to the place itself.
fn integral_from_below(place: TablePlace) -> f32 {
    let within = place.part * mix(place.row.x, place.row.y, 0.5 * place.part);
    return within + place.outside * select(place.row.x, place.row.y, place.outside > 0.0);
}

// The mean over intensities between two.
fn mean_between(a: TablePlace, b: TablePlace) -> f32 {
    let span = b.entry - a.entry;
    let whole = (b.row.z - a.row.z) + (b.row.w - a.row.w);
    let integral = whole + (integral_from_below(b) - integral_from_below(a));
    // Between two entries the function is linear.
    let middle = mix(a.row.x, a.row.y, a.part + 0.5 * (b.part - a.part));
    let is_between_two = a.below == b.below && a.outside == 0.0 && b.outside == 0.0;
    let is_one = is_between_two || abs(span) < SAME;
    return max(select(integral / select(span, 1.0, is_one), middle, is_one), 0.0);
}

// Opacity of a slice of mean extinction, `steps` drawing steps long.
fn slice_opacity(extinction: f32, steps: f32) -> f32 {
    return 1.0 - exp(-extinction * steps * volume.draw_exponent);
}
