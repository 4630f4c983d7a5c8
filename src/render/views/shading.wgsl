// Shading of samples of a volume: darkened by occlusion and, if set, lit by Blinn-Phong (CAO paper,
// section 3.5). Normals come from `orientation`, the light is at the camera. LIT is set where there may be a light.

#define_import_path bevy_contextual_ao::shading

#import bevy_contextual_ao::{orientation::{Cut, orientation_at}, volume_bindings::volume}

// Blinn-Phong coefficients.
const AMBIENT: f32 = 0.3;
const DIFFUSE: f32 = 0.7;
const SPECULAR: f32 = 0.2;
const SHININESS: f32 = 16.0;

// Colour of a sample lit from the camera, which looks along `direction`. `opacity` is the opacity that the
// sample adds to the pixel, `ambient` the share of the light that reaches it, `cut` the cut in front of it.
fn shade(
    color: vec3<f32>,
    opacity: f32,
    p: vec3<f32>,
    direction: vec3<f32>,
    ambient: f32,
    cut: Cut,
) -> vec3<f32> {
#ifdef LIT
    if opacity * volume.light_share <= 0.0 {
        return volume.exposure * color * ambient;
    }
    let orientation = orientation_at(p, cut);
    let size = length(orientation.inward);
    let is_surface = size > 1e-6;
    let cosine = select(1.0, abs(dot(orientation.inward, direction)) / size, is_surface);
    // Where the opacity does not change there is no surface to light.
    let strength = select(0.0, orientation.strength, is_surface);
    let facing = mix(1.0, cosine, strength);
    let highlight = strength * SPECULAR * pow(cosine, SHININESS);
    return volume.exposure * (color * (AMBIENT + DIFFUSE * facing) * ambient + highlight);
#else
    return volume.exposure * color * ambient;
#endif
}
