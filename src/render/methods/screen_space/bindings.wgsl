// Uniforms of a view for the passes of screen-space occlusion, and the format of the surface in each of its pixels.
// The Rust side is `uniform.rs`.

#define_import_path bevy_contextual_ao::screen_space

struct ScreenSpaceView {
    clip_from_view: mat4x4<f32>,
    view_from_clip: mat4x4<f32>,
    // Origin and size, pixels.
    viewport: vec4<f32>,
    // Distance within which surfaces occlude, and how far an occluder must be in front; world units.
    radius: f32,
    bias: f32,
}

// Points of the half ball around the z axis, in radii, and their number.
struct Kernel {
    points: array<vec4<f32>, 256>,
    samples: u32,
}

// Surface that a pixel shows: distance from the plane through the camera, world units, and unit normal towards the
// viewer, view space.
struct Surface {
    depth: f32,
    normal: vec3<f32>,
}

// Pixels of this depth or more show nothing.
const FAR: f32 = 1e30;

// Packs a surface into a texel, with an octahedral normal (Meyer et al. 2010).
fn pack_surface(surface: Surface) -> vec4<u32> {
    let n = surface.normal / dot(abs(surface.normal), vec3(1.0));
    let folded = (1.0 - abs(n.yx)) * select(vec2(-1.0), vec2(1.0), n.xy >= vec2(0.0));
    let flat = select(folded, n.xy, n.z >= 0.0);
    return vec4(bitcast<u32>(surface.depth), pack2x16snorm(flat), 0u, 0u);
}

fn unpack_surface(texel: vec4<u32>) -> Surface {
    let flat = unpack2x16snorm(texel.y);
    let z = 1.0 - abs(flat.x) - abs(flat.y);
    let unfold = max(-z, 0.0) * select(vec2(1.0), vec2(-1.0), flat >= vec2(0.0));
    return Surface(bitcast<f32>(texel.x), normalize(vec3(flat + unfold, z)));
}

// Point, view space, at a place of the image, pixels from the viewport's origin.
fn view_position(view: ScreenSpaceView, place: vec2<f32>, depth: f32) -> vec3<f32> {
    let ndc = place / view.viewport.zw * vec2(2.0, -2.0) + vec2(-1.0, 1.0);
    let near_clip = view.view_from_clip * vec4(ndc, 1.0, 1.0);
    let near = near_clip.xyz / near_clip.w;
    // Rays are parallel if the projection is orthographic. Its last row is that of the identity.
    let is_parallel = view.view_from_clip[2].w == 0.0;
    return vec3(near.xy * select(-depth / near.z, 1.0, is_parallel), -depth);
}
