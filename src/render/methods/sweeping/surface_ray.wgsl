// Hit of a view ray on an isosurface that is drawn alone: the ray's first sample that lies inside and is not clipped.
// Halving the step before it refines the hit. Rays leap over samples where the distance field (Singh, Yuksel, House
// 2009, section 1.1) is empty (sphere tracing, Hart 1996). The field only leaves out samples: hits follow from the
// intensities and the carvers, not from the field.

#define_import_path bevy_contextual_ao::surface_ray

#import bevy_contextual_ao::{
    classification::classify,
    gradients::gradient_at,
    next_run::{CUT_HALVINGS, is_visible_at},
    orientation::distance_from_surface,
    view_ray::{ViewRay, along_ray, samples_of},
    volume_bindings::{edge_sampler, intensities, may_be_visible, volume},
}

// Distances by fast sweeping are too long, most of all around a point. The true distance is more than this share of
// them, less a quarter of a cell's diagonal.
const DISTANCE_SHARE: f32 = 0.9;

struct SurfaceHit {
    color: vec3<f32>,
    // 1, or 0 if nothing is hit.
    alpha: f32,
    // Texture coordinates, and distance from the ray's start.
    p: vec3<f32>,
    along_mm: f32,
}

fn is_inside(ray: ViewRay, along_mm: f32) -> bool {
    let intensity = textureSampleLevel(intensities, edge_sampler, ray.origin + along_mm * ray.velocity, 0.0).r;
    return may_be_visible(intensity) && is_visible_at(ray, along_mm);
}

fn surface_hit(ray: ViewRay) -> SurfaceHit {
    // The last sample is where the ray ends.
    let count = select(0u, samples_of(ray) + 1u, ray.begin_mm < ray.end_mm);
    // A visible point inside has a voxel within a cell's diagonal that is in or on the field's surface, or next to
    // such a voxel. The margin covers two diagonals, a brick's radius, and the quarter above.
    let margin_mm = 1.25 * volume.brick_radius_mm;
    var i = 0u;
    while i < count {
        let along_mm = min(along_ray(ray, i), ray.end_mm);
        let distance_mm = distance_from_surface(ray.origin + along_mm * ray.velocity);
        let free_mm = select(-1.0, DISTANCE_SHARE * distance_mm - margin_mm, volume.draw_leaps == 1u);
        if free_mm < 0.0 && is_inside(ray, along_mm) {
            break;
        }
        i += 1u + u32(max(free_mm, 0.0) / volume.draw_step_mm);
    }
    var inside_mm = min(along_ray(ray, i), ray.end_mm);
    var outside_mm = max(inside_mm - volume.draw_step_mm, ray.begin_mm);
    for (var k = 0; k < CUT_HALVINGS && i < count; k += 1) {
        let middle_mm = 0.5 * (inside_mm + outside_mm);
        if is_inside(ray, middle_mm) {
            inside_mm = middle_mm;
        } else {
            outside_mm = middle_mm;
        }
    }
    let p = ray.origin + inside_mm * ray.velocity;
    let intensity = textureSampleLevel(intensities, edge_sampler, p, 0.0).r;
    let color = classify(intensity, gradient_at(p)).rgb;
    return SurfaceHit(color, select(0.0, 1.0, i < count), p, inside_mm);
}
