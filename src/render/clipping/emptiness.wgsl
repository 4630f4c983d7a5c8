// Tests for bricks that are transparent whatever the carvers do. The range of intensities around a brick decides,
// because drawing classifies interpolated intensities: a cell can be visible although its corners are transparent.

#define_import_path bevy_contextual_ao::emptiness

#import bevy_contextual_ao::volume_bindings::lookup_entry

// Number of table entries with opacity before each entry.
@group(1) @binding(0) var<storage, read> opaque_before: array<u32>;
// Of each brick: lowest and highest intensity around it, 16 bits each, and its smoothing (`ranges.wgsl`).
@group(1) @binding(1) var<storage, read> ranges: array<vec2<u32>>;

// Whether all intensities of a range, as textures give them, are transparent.
fn is_range_transparent(lowest: f32, highest: f32) -> bool {
    let last = f32(arrayLength(&opaque_before) - 2u);
    let first = u32(clamp(floor(lookup_entry(lowest)), 0.0, last));
    let end = u32(clamp(ceil(lookup_entry(highest)), 0.0, last)) + 1u;
    return opaque_before[end] == opaque_before[first];
}

fn is_brick_transparent(brick: u32) -> bool {
    let range = unpack2x16unorm(ranges[brick].x);
    return is_range_transparent(range.x, range.y);
}
