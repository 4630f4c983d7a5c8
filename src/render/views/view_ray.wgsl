// View rays: their course through a volume, and the places of their samples.

#define_import_path bevy_contextual_ao::view_ray

#import bevy_contextual_ao::{volume_bindings::{lookup_table, volume}, window::Window}

// A ray is finished at this accumulated opacity.
const OPAQUE: f32 = 0.99;
// Most samples of a ray. `runs` keeps their indices in 20 bits.
const MOST_SAMPLES: f32 = 1e6;

struct ViewRay {
    // Where the ray starts on the near plane, volume space (mm), and its unit direction.
    near: vec3<f32>,
    direction: vec3<f32>,
    // Start and direction in texture coordinates; the direction is still per mm.
    origin: vec3<f32>,
    velocity: vec3<f32>,
    // Part of the ray in the volume's box, mm from `near`. It is empty unless `begin_mm` is less than `end_mm`.
    begin_mm: f32,
    end_mm: f32,
    // Distance of `near` from the plane through the camera, and its increase per mm; world units.
    near_depth: f32,
    depth_per_mm: f32,
    // Length of the first interval, steps.
    offset: f32,
    // Where the ray goes through, pixels.
    place: vec2<f32>,
}

// Row of the lookup table with a tile of blue noise, and pixels along each side of the tile.
const NOISE_ROW: u32 = 2u;
const NOISE_SIDE: u32 = 64u;

// Blue noise (`blue_noise.rs`), [0, 1).
fn noise(pixel: vec2<f32>) -> f32 {
    let place = vec2<u32>(pixel) % NOISE_SIDE;
    return textureLoad(lookup_table, vec2(place.y * NOISE_SIDE + place.x, NOISE_ROW), 0).r;
}

// The ray through a place, pixels. `noise_shift` is added to the noise that its first interval's length follows.
fn view_ray(place: vec2<f32>, window: Window, noise_shift: f32) -> ViewRay {
    let viewport = window.viewport;
    let view_from_clip = window.view_from_clip;
    let world_from_view = window.world_from_view;
    let ndc = (place - viewport.xy) / viewport.zw * vec2(2.0, -2.0) + vec2(-1.0, 1.0);
    let near_clip = view_from_clip * vec4(ndc, 1.0, 1.0);
    let near_view = near_clip.xyz / near_clip.w;
    // An orthographic projection has parallel rays. Its last row is that of the identity.
    let is_parallel = view_from_clip[2].w == 0.0;
    let direction_view = select(near_view, vec3(0.0, 0.0, -1.0), is_parallel);
    let near = (volume.local_from_world * (world_from_view * vec4(near_view, 1.0))).xyz;
    let along = (volume.local_from_world * (world_from_view * vec4(direction_view, 0.0))).xyz;
    let direction = normalize(along);
    let origin = (volume.texture_from_local * vec4(near, 1.0)).xyz;
    let velocity = (volume.texture_from_local * vec4(direction, 0.0)).xyz;
    // Distances at which the ray crosses the planes of the box. A ray parallel to two planes
    // never crosses them: it lies between the two all along, or outside.
    let still = abs(velocity) < vec3(1e-9);
    let first = (select(vec3(0.0), vec3(1.0), velocity < vec3(0.0)) - origin) / velocity;
    let second = (select(vec3(1.0), vec3(0.0), velocity < vec3(0.0)) - origin) / velocity;
    let is_beside = still & ((origin < vec3(0.0)) | (origin > vec3(1.0)));
    let entries = select(first, select(vec3(0.0), vec3(1e9), is_beside), still);
    let exits = select(second, vec3(1e9), still);
    var ray: ViewRay;
    ray.near = near;
    ray.direction = direction;
    ray.origin = origin;
    ray.velocity = velocity;
    ray.begin_mm = max(0.0, max(entries.x, max(entries.y, entries.z)));
    ray.end_mm = min(exits.x, min(exits.y, exits.z));
    ray.near_depth = -near_view.z;
    ray.depth_per_mm = -direction_view.z / length(along);
    ray.place = place;
    ray.offset = mix(0.5, fract(noise(place) + noise_shift), volume.jitter_share);
    return ray;
}

// Distance of a sample from `near`. The first lies where the ray begins, the second at the offset behind it.
fn along_ray(ray: ViewRay, i: u32) -> f32 {
    return ray.begin_mm + max(f32(i) - 1.0 + ray.offset, 0.0) * volume.draw_step_mm;
}

// Number of intervals of a ray. Interval i begins at sample i. The last one may reach beyond the ray's end.
fn samples_of(ray: ViewRay) -> u32 {
    let steps = (ray.end_mm - ray.begin_mm) / volume.draw_step_mm;
    return select(0u, u32(clamp(ceil(steps - ray.offset), 0.0, MOST_SAMPLES - 1.0)) + 1u, steps > 0.0);
}

// Depth of a point of a ray: its distance from the plane through the camera, world units.
fn depth_at(ray: ViewRay, along_mm: f32) -> f32 {
    return ray.near_depth + along_mm * ray.depth_per_mm;
}

// Distance from `near` of a ray's point at a depth, mm.
fn along_of_depth(ray: ViewRay, depth: f32) -> f32 {
    return (depth - ray.near_depth) / ray.depth_per_mm;
}
