// Shading of samples of a volume: darkened by occlusion and, if set, lit by Blinn-Phong (CAO paper,
// section 3.5). Normals come from `orientation`, the light is at the camera. LIT is set where there may be a light.

#define_import_path bevy_contextual_ao::shading

#import bevy_contextual_ao::{orientation::{Cut, inward}, volume_bindings::volume}

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
        return color * ambient;
    }
    let gradient = inward(p, cut);
    let steepness = length(gradient);
    // Where the opacity does not change there is no surface to light.
    let facing = select(1.0, abs(dot(gradient, direction)) / steepness, steepness > 1e-6);
    let highlight = select(0.0, SPECULAR * pow(facing, SHININESS), steepness > 1e-6);
    return color * (AMBIENT + DIFFUSE * facing) * ambient + highlight;
#else
    return color * ambient;
#endif
}
