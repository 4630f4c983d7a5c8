// Surface of opaque meshes in each pixel of a view, from the depth prepass: distances, and normals from differences
// between neighbours. Of two neighbours the one nearer in depth counts.

#import bevy_contextual_ao::screen_space::{FAR, ScreenSpaceView, Surface, pack_surface, view_position}

@group(0) @binding(0) var<uniform> view: ScreenSpaceView;
@group(0) @binding(1) var surfaces: texture_storage_2d<rg32uint, write>;
#ifdef DEPTH_MULTISAMPLED
@group(0) @binding(2) var depths: texture_depth_multisampled_2d;
#else ifdef DEPTH
@group(0) @binding(2) var depths: texture_depth_2d;
#endif

// Distance from the plane through the camera; FAR outside of the viewport.
fn depth_at(pixel: vec2<i32>) -> f32 {
#ifdef DEPTH
    if any(pixel < vec2(0)) || any(pixel >= vec2<i32>(view.viewport.zw)) {
        return FAR;
    }
    let depth = textureLoad(depths, pixel + vec2<i32>(view.viewport.xy), 0);
    // Depth is reversed: 0 is infinitely far.
    if depth <= 0.0 {
        return FAR;
    }
    // x and y do not change the distance.
    let point = view.view_from_clip * vec4(0.0, 0.0, depth, 1.0);
    return min(-point.z / point.w, FAR);
#else
    return FAR;
#endif
}

// Vector from a point to the surface in another pixel.
fn way_to(pixel: vec2<i32>, from_point: vec3<f32>) -> vec3<f32> {
    let depth = depth_at(pixel);
    if depth >= FAR {
        return vec3(0.0, 0.0, FAR);
    }
    return view_position(view, vec2<f32>(pixel) + 0.5, depth) - from_point;
}

// Vector along an axis of the image, from the neighbour whose depth differs less.
fn slope(pixel: vec2<i32>, axis: vec2<i32>, from_point: vec3<f32>) -> vec3<f32> {
    let ahead = way_to(pixel + axis, from_point);
    let back = way_to(pixel - axis, from_point);
    return select(ahead, -back, abs(back.z) < abs(ahead.z));
}

@compute @workgroup_size(8, 8)
fn find_opaque(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= textureDimensions(surfaces)) {
        return;
    }
    let pixel = vec2<i32>(id.xy);
    var surface = Surface(depth_at(pixel), vec3(0.0, 0.0, 1.0));
    if surface.depth < FAR {
        let point = view_position(view, vec2<f32>(pixel) + 0.5, surface.depth);
        let across = slope(pixel, vec2(1, 0), point);
        let down = slope(pixel, vec2(0, 1), point);
        // The image's y axis runs downwards.
        let normal = cross(down, across);
        // A pixel without neighbours along an axis faces the camera.
        if max(abs(across.z), abs(down.z)) < 0.5 * FAR && dot(normal, normal) > 0.0 {
            surface.normal = normalize(normal);
        }
    }
    textureStore(surfaces, id.xy, pack_surface(surface));
}
