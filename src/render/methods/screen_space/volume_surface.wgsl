// Surface of a volume for screen-space occlusion (Kitware 2023): the first sample of each view ray whose opacity
// reaches a threshold. The samples are those of drawing. The normal is that of the clipped opacity. A nearer surface
// found before stays.
//
// Kitware's surface lies on samples. Here the place that reaches the threshold is found between two samples, so that
// the jitter of view rays shows no noise.

#import bevy_contextual_ao::{
    classification::{classify, correct_opacity},
    gradients::gradient_at,
    lit_slices::intensity_at,
    next_run::{begin_march, is_visible_at, next_run},
    orientation::{inward_by_opacities, inward_from_face},
    runs::{slice_of_run, slices_of},
    screen_space::{Surface, pack_surface, unpack_surface},
    view_ray::{OPAQUE, ViewRay, along_of_depth, depth_at, view_ray},
    volume_bindings::volume,
    window::Window,
}

@group(1) @binding(0) var<uniform> window: Window;
// Opacity of a drawing step.
@group(1) @binding(1) var<uniform> opacity_threshold: f32;
// Surfaces found before, a texel for each pixel of the viewport, and surfaces that this pass finds.
@group(1) @binding(2) var before: texture_2d<u32>;
@group(1) @binding(3) var surfaces: texture_storage_2d<rg32uint, write>;

// The surface is found to a step divided by this power of two.
const SURFACE_HALVINGS: i32 = 5;

fn place_at(ray: ViewRay, along_mm: f32) -> vec3<f32> {
    return ray.origin + along_mm * ray.velocity;
}

// Whether the opacity at the point of a ray reaches the threshold.
fn is_opaque_at(ray: ViewRay, along_mm: f32) -> bool {
    let opacity = classify(intensity_at(ray, along_mm), gradient_at(place_at(ray, along_mm))).a;
    return correct_opacity(opacity, volume.draw_exponent) >= opacity_threshold;
}

fn is_surface_at(ray: ViewRay, along_mm: f32) -> bool {
    return is_opaque_at(ray, along_mm) && is_visible_at(ray, along_mm);
}

// Distance of the surface from `near`; negative if the ray meets none.
fn surface_along(ray: ViewRay) -> f32 {
    var march = begin_march(ray);
    while march.alpha < OPAQUE {
        let run = next_run(ray, &march, OPAQUE);
        let slices = slices_of(run);
        if slices == 0u {
            break;
        }
        for (var k = 0u; k < slices; k += 1u) {
            let slice = slice_of_run(ray, run, k);
            // The first end that reaches the threshold.
            let begins = is_opaque_at(ray, slice.begin_mm);
            let ends = is_opaque_at(ray, slice.end_mm);
            if !begins && !ends {
                continue;
            }
            var inside_mm = select(slice.end_mm, slice.begin_mm, begins);
            var outside_mm = max(select(slice.begin_mm, inside_mm - volume.draw_step_mm, begins), ray.begin_mm);
            for (var halving = 0; halving < SURFACE_HALVINGS; halving += 1) {
                let middle_mm = 0.5 * (inside_mm + outside_mm);
                if is_surface_at(ray, middle_mm) {
                    inside_mm = middle_mm;
                } else {
                    outside_mm = middle_mm;
                }
            }
            return inside_mm;
        }
    }
    return -1.0;
}

// Normal towards the viewer, view space.
fn normal_at(ray: ViewRay, along_mm: f32) -> vec3<f32> {
    let p = place_at(ray, along_mm);
    // A surface at the end of the grid faces that way, whatever the opacities are.
    var gradient = inward_from_face(p);
    if dot(gradient, gradient) <= 0.0 {
        gradient = inward_by_opacities(p);
    }
    if dot(gradient, gradient) < 1e-8 {
        // The opacity does not change here.
        return vec3(0.0, 0.0, 1.0);
    }
    let away = select(-gradient, gradient, dot(gradient, ray.direction) < 0.0);
    // Gradients transform the other way than points.
    let world = (transpose(volume.local_from_world) * vec4(away, 0.0)).xyz;
    return normalize((transpose(window.world_from_view) * vec4(world, 0.0)).xyz);
}

@compute @workgroup_size(8, 8)
fn find_surface(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= textureDimensions(surfaces)) {
        return;
    }
    var texel = textureLoad(before, id.xy, 0);
    let pixel = vec2<u32>(window.viewport.xy) + id.xy;
    if all(pixel >= window.first) && all(pixel < window.end) {
        let place = vec2<f32>(pixel) + 0.5;
        var ray = view_ray(place, window, 0.0);
        // The ray ends at the surface found before.
        ray.end_mm = min(ray.end_mm, along_of_depth(ray, unpack_surface(texel).depth));
        let along_mm = surface_along(ray);
        if along_mm >= 0.0 {
            texel = pack_surface(Surface(depth_at(ray, along_mm), normal_at(ray, along_mm)));
        }
    }
    textureStore(surfaces, id.xy, texel);
}
