// View rays: their course through a volume, and their samples. Drawing shades the samples. Before
// that, `mark` takes the same steps to find the voxels that drawing will read.
//
// Samples are classified after interpolation. Where a ray enters or leaves a carver, the cut is found
// and sampled. The paper (section 3.5, step VI) samples at steps alone. Rays leap over bricks that
// are known to be empty. Clip tests check only the carvers near a sample.
//
// No branch depends on uniforms alone (2 in docs/drivers.md).

#define_import_path bevy_contextual_ao::view_ray

#import bevy_contextual_ao::{
    brick_bindings::{carvers_near, distance_at},
    bricks::samples_within,
    clip_test::is_visible,
    volume_bindings::{classify_intensity, edge_sampler, intensities, may_be_visible, volume},
}

// A ray is finished at this accumulated opacity.
const OPAQUE: f32 = 0.99;
// A step is halved this often to find a cut. The error is less than one level of an 8-bit image.
const CUT_HALVINGS: i32 = 6;
// States of a sample: transparent; not transparent; not transparent but clipped.
const EMPTY: u32 = 0u;
const VISIBLE: u32 = 1u;
const CLIPPED: u32 = 2u;
// Visible behind a clipped sample; the cut between the two is sampled first.
const CUT: u32 = 3u;

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
    // Place of the samples within their steps, 0 to 1.
    offset: f32,
}

// Interleaved gradient noise (Jimenez 2014), [0, 1).
fn noise(pixel: vec2<f32>) -> f32 {
    return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
}

// The ray through the centre of a pixel.
fn view_ray(
    pixel: vec2<f32>,
    viewport: vec4<f32>,
    view_from_clip: mat4x4<f32>,
    world_from_view: mat4x4<f32>,
) -> ViewRay {
    let ndc = (pixel - viewport.xy) / viewport.zw * vec2(2.0, -2.0) + vec2(-1.0, 1.0);
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
    ray.offset = mix(0.5, noise(floor(pixel)), volume.jitter_share);
    return ray;
}

// Part of a ray with one colour and opacity, sampled at a point.
struct Slice {
    sample: vec4<f32>,
    // Texture coordinates.
    p: vec3<f32>,
    // Length in steps; 0: there is no slice.
    steps: f32,
}

// State of following a ray.
struct March {
    i: u32,
    count: u32,
    before: u32,
    last: Slice,
    // Distance of the cut from `near`.
    cut_mm: f32,
}

fn begin_march(ray: ViewRay) -> March {
    let count = ceil((ray.end_mm - ray.begin_mm) / volume.draw_step_mm - ray.offset);
    return March(0u, u32(clamp(count, 0.0, 1e6) * volume.march_share), EMPTY, Slice(vec4(0.0), vec3(0.0), 0.0), 0.0);
}

// Whether the point of a ray at a distance from `near` is not clipped.
fn is_visible_at(ray: ViewRay, along_mm: f32) -> bool {
    let point = (ray.origin + along_mm * ray.velocity) * vec3<f32>(volume.dimensions);
    return is_visible(ray.near + along_mm * ray.direction, carvers_near(point));
}

fn along_ray(ray: ViewRay, i: u32) -> f32 {
    return ray.begin_mm + (f32(i) + ray.offset) * volume.draw_step_mm;
}

// Follows a ray through transparent samples to the next place of interest, and returns the intensity there.
// This is a sample that may not be transparent, a sample that ends a visible part, or the cut. The loop does
// nothing else: a device runs neighbouring rays in step, and so they wait little for each other.
fn seek(ray: ViewRay, march: ptr<function, March>) -> f32 {
    let dimensions = vec3<f32>(volume.dimensions);
    let step = volume.draw_step_mm * ray.velocity * dimensions;
    let follows = (*march).before == VISIBLE || (*march).before == CUT;
    var i = (*march).i;
    var before = (*march).before;
    var intensity = 0.0;
    while i < (*march).count {
        let point = (ray.origin + along_ray(ray, i) * ray.velocity) * dimensions;
        let distance = select(distance_at(point) * volume.draw_leaps, 0u, follows);
        if distance > 0u {
            // Leaps to the last sample in the empty bricks: the next one needs the state of the sample before it.
            i += min((*march).count - i, samples_within(point, step, distance)) - 1u;
        }
        let place_mm = select(along_ray(ray, i), (*march).cut_mm, before == CUT);
        let p = ray.origin + place_mm * ray.velocity;
        intensity = textureSampleLevel(intensities, edge_sampler, p, 0.0).r;
        if follows || may_be_visible(intensity) {
            break;
        }
        before = EMPTY;
        i += 1u;
    }
    (*march).i = i;
    (*march).before = before;
    return intensity;
}

// The next slice of a ray that is not transparent.
fn next_slice(ray: ViewRay, march: ptr<function, March>) -> Slice {
    let step_mm = volume.draw_step_mm;
    var slice = Slice(vec4(0.0), vec3(0.0), 0.0);
    while slice.steps <= 0.0 {
        let intensity = seek(ray, march);
        if (*march).i >= (*march).count {
            break;
        }
        let along = along_ray(ray, (*march).i);
        let sample = classify_intensity(intensity);
        let before = (*march).before;
        if before == CUT {
            let cut_mm = (*march).cut_mm;
            slice = Slice(sample, ray.origin + cut_mm * ray.velocity, (along - cut_mm) / step_mm);
            (*march).before = VISIBLE;
            (*march).i += 1u;
            continue;
        }
        // Tests whether the sample is clipped. Where the ray crosses a carver's surface, halving finds the cut:
        // the visible point nearest to the surface.
        var now = EMPTY;
        var enters = false;
        var leaves = false;
        var visible_mm = along;
        var clipped_mm = along;
        var point_mm = along;
        for (var k = 0; k <= CUT_HALVINGS; k += 1) {
            let is_shown = is_visible_at(ray, point_mm);
            if k == 0 {
                now = select(EMPTY, select(CLIPPED, VISIBLE, is_shown), sample.a > 0.0);
                enters = before == CLIPPED && now == VISIBLE;
                leaves = before == VISIBLE && now == CLIPPED;
                visible_mm -= select(0.0, step_mm, leaves);
                clipped_mm -= select(0.0, step_mm, enters);
            } else if is_shown {
                visible_mm = point_mm;
            } else {
                clipped_mm = point_mm;
            }
            if !enters && !leaves {
                break;
            }
            point_mm = 0.5 * (visible_mm + clipped_mm);
        }
        if before == VISIBLE {
            // The previous sample stands for the step from there to here, up to the cut if there is one.
            slice = (*march).last;
            slice.steps += select(0.0, (visible_mm - along) / step_mm, leaves);
        }
        (*march).last = Slice(sample, ray.origin + along * ray.velocity, 1.0);
        // The rest of the step is sampled at the cut. So surfaces of cuts do not jump when a carver moves by
        // less than a step. They are as smooth as the carver.
        (*march).cut_mm = visible_mm;
        (*march).before = select(now, CUT, enters);
        (*march).i += select(1u, 0u, enters);
    }
    if slice.steps <= 0.0 && (*march).before == VISIBLE {
        slice = (*march).last;
        (*march).before = EMPTY;
    }
    return slice;
}
