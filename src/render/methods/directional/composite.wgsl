// Composites a volume shaded by directional occlusion over the image that the view has drawn so far.

#import bevy_render::view::View
#import bevy_contextual_ao::window::Window
#ifdef TONEMAP_IN_SHADER
#import bevy_core_pipeline::tonemapping::tone_mapping
#endif

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> window: Window;
// Premultiplied colour and opacity of every pixel of the window.
@group(0) @binding(2) var<storage, read> eye: array<vec4<f32>>;

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let place = vec2<u32>(position.xy) - window.first;
    var pixel = eye[place.y * (window.end.x - window.first.x) + place.x];
    if pixel.a <= 0.0 {
        discard;
    }
#ifdef TONEMAP_IN_SHADER
    let mapped = tone_mapping(vec4(pixel.rgb / pixel.a, 1.0), view.color_grading).rgb;
    pixel = vec4(mapped * pixel.a, pixel.a);
#endif
    return pixel;
}
