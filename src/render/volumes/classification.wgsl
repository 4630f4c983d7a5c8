// Classification: from an intensity and its gradient to colour and opacity (Kniss, Kindlmann and Hansen 2002).
//
// Rows of the lookup table are even steps of the gradient (`gradients`), with three kinds of row for each. The Rust side
// is `gpu_table.rs`.

#define_import_path bevy_contextual_ao::classification

#import bevy_contextual_ao::volume_bindings::{lookup_entry, lookup_table, volume}

// Rows of the occlusion method and of noise come first.
const ROWS_BEFORE: u32 = 3u;
// Kinds of row: colour and opacity per unit distance; extinction per opacity unit distance; opacity of an occlusion step.
const COLORS: u32 = 0u;
const EXTINCTIONS: u32 = 1u;
const OCCLUSIONS: u32 = 2u;
const KINDS: u32 = 3u;

// An entry of a kind of row for a gradient, which is a number of rows.
fn table_entry(entry: u32, kind: u32, gradient: f32) -> vec4<f32> {
    let row = ROWS_BEFORE + KINDS * u32(gradient) + kind;
    let below = textureLoad(lookup_table, vec2(entry, row), 0);
#ifdef BY_GRADIENT
    let next = select(row, row + KINDS, gradient < volume.last_gradient_row);
    return mix(below, textureLoad(lookup_table, vec2(entry, next), 0), fract(gradient));
#else
    return below;
#endif
}

// Colour (linear RGB) and opacity per unit distance of an intensity, as a texture gives it.
fn classify(intensity: f32, gradient: f32) -> vec4<f32> {
    let last = f32(textureDimensions(lookup_table).x - 1u);
    let entry = clamp(lookup_entry(intensity), 0.0, last);
    let below = min(floor(entry), last - 1.0);
    let a = table_entry(u32(below), COLORS, gradient);
    let b = table_entry(u32(below) + 1u, COLORS, gradient);
    return mix(a, b, entry - below);
}

// Opacity per unit distance → opacity of a step. `exponent` is the ratio of step to unit distance.
fn correct_opacity(opacity: f32, exponent: f32) -> f32 {
    return select(1.0 - pow(1.0 - opacity, exponent), opacity, exponent == 1.0);
}
