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
