// Darkens the image of a view by the factors of screen-space occlusion: blending multiplies the colour behind by the
// returned factor. The even blur covers the 4x4 pixels that have all angles of the kernel. It leaves out pixels farther
// from the pixel's own depth than the radius, so that outlines stay sharp. The other blur is that of VTK's pass: a
// Gaussian over 3x3 pixels, of a deviation of one pixel.

#import bevy_core_pipeline::fullscreen_vertex_shader::FullscreenVertexOutput
#import bevy_contextual_ao::screen_space::ScreenSpaceView

@group(0) @binding(0) var<uniform> view: ScreenSpaceView;
@group(0) @binding(1) var factors: texture_2d<f32>;
@group(0) @binding(2) var surfaces: texture_2d<u32>;

fn depth_at(pixel: vec2<i32>) -> f32 {
    return bitcast<f32>(textureLoad(surfaces, pixel, 0).x);
}

@fragment
fn fragment(in: FullscreenVertexOutput) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(floor(in.position.xy - view.viewport.xy));
#ifdef EVEN
    let last = vec2<i32>(textureDimensions(factors)) - 1;
    let depth = depth_at(pixel);
    var sum = vec2(0.0);
    for (var k = 0; k < 16; k += 1) {
        let place = pixel + vec2(k % 4, k / 4) - 2;
        let inside = clamp(place, vec2(0), last);
        let counts = all(place == inside) && abs(depth_at(inside) - depth) <= view.radius;
        sum += select(vec2(0.0), vec2(textureLoad(factors, inside, 0).r, 1.0), counts);
    }
    let factor = sum.x / sum.y;
#else ifdef GAUSSIAN
    let last = vec2<i32>(textureDimensions(factors)) - 1;
    var sum = vec2(0.0);
    for (var k = 0; k < 9; k += 1) {
        let offset = vec2(k % 3, k / 3) - 1;
        let weight = exp(-0.5 * f32(offset.x * offset.x + offset.y * offset.y));
        sum += weight * vec2(textureLoad(factors, clamp(pixel + offset, vec2(0), last), 0).r, 1.0);
    }
    let factor = sum.x / sum.y;
#else
    let factor = textureLoad(factors, pixel, 0).r;
#endif
    return vec4(vec3(factor), 1.0);
}
