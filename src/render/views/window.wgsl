// A window: the part of a view in which a volume may be seen, for passes over its pixels. The Rust side is
// `WindowUniform`.

#define_import_path bevy_contextual_ao::window

struct Window {
    view_from_clip: mat4x4<f32>,
    world_from_view: mat4x4<f32>,
    // Origin and size, pixels.
    viewport: vec4<f32>,
    // Pixels in which the volume may be seen.
    first: vec2<u32>,
    end: vec2<u32>,
}

// Pixel of an invocation in a workgroup of 8x8 pixels. Neighbouring invocations, which a device runs in step, have
// neighbouring pixels: 4x2, then 8x2, then 8x4.
fn pixel_of_lane(lane: u32) -> vec2<u32> {
    return vec2((lane & 3u) | ((lane >> 1u) & 4u), ((lane >> 2u) & 1u) | ((lane >> 3u) & 6u));
}
