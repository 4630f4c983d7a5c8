// Open share of the half ball around the point in each pixel, as VTK's `vtkSSAOPass` estimates it. Points of the half
// ball count as hidden where the view sees a surface in front of them. This fades out where that surface is farther
// from the pixel's own point than the radius. Points outside of the image are not hidden.
//
// VTK turns the kernel by random angles. Here each of 4x4 pixels has one of 16 even angles, so that a blur over 4x4
// pixels has them all.

#import bevy_contextual_ao::screen_space::{FAR, Kernel, ScreenSpaceView, unpack_surface, view_position}

@group(0) @binding(0) var<uniform> view: ScreenSpaceView;
@group(0) @binding(1) var<uniform> kernel: Kernel;
@group(0) @binding(2) var surfaces: texture_2d<u32>;
#ifdef STORE_R8
@group(0) @binding(3) var factors: texture_storage_2d<r8unorm, write>;
#else
@group(0) @binding(3) var factors: texture_storage_2d<rgba8unorm, write>;
#endif

const TAU: f32 = 6.2831853;

// Angle by which the kernel is turned: an ordered pattern (Bayer 1973) in which neighbours differ much.
fn angle_of(pixel: vec2<u32>) -> f32 {
    let a = pixel.x ^ pixel.y;
    let rank = ((a & 1u) << 3u) | ((pixel.y & 1u) << 2u) | (a & 2u) | ((pixel.y & 2u) >> 1u);
    return f32(rank) / 16.0 * TAU;
}

@compute @workgroup_size(8, 8)
fn occlusion(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(surfaces);
    if any(id.xy >= size) {
        return;
    }
    let surface = unpack_surface(textureLoad(surfaces, id.xy, 0));
    let samples = kernel.samples;
    var hidden = 0.0;
    if surface.depth < FAR {
        let center = view_position(view, vec2<f32>(id.xy) + 0.5, surface.depth);
        let normal = surface.normal;
        let angle = angle_of(id.xy);
        let towards = vec3(cos(angle), sin(angle), 0.0);
        var tangent = towards - normal * dot(towards, normal);
        if dot(tangent, tangent) < 1e-4 {
            tangent = cross(normal, vec3(0.0, 0.0, 1.0));
        }
        tangent = normalize(tangent);
        let bitangent = cross(normal, tangent);
        for (var k = 0u; k < samples; k += 1u) {
            let offset = view.radius * kernel.points[k].xyz;
            let point = center + tangent * offset.x + bitangent * offset.y + normal * offset.z;
            let clip = view.clip_from_view * vec4(point, 1.0);
            if clip.w <= 0.0 {
                continue;
            }
            let place = (clip.xy / clip.w * vec2(0.5, -0.5) + 0.5) * vec2<f32>(size);
            if any(place < vec2(0.0)) || any(place >= vec2<f32>(size)) {
                continue;
            }
            let depth = bitcast<f32>(textureLoad(surfaces, vec2<u32>(place), 0).x);
            let is_hidden = depth <= -point.z - view.bias;
            let apart = max(abs(surface.depth - depth), 1e-30);
            hidden += select(0.0, smoothstep(0.0, 1.0, view.radius / apart), is_hidden);
        }
    }
    let factor = 1.0 - hidden / f32(samples);
    textureStore(factors, id.xy, vec4(factor, 0.0, 0.0, 1.0));
}
