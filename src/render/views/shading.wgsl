// Shading of samples of a volume: darkened by occlusion (step VI of the CAO paper, section 3.5) and, if set, lit by
// Blinn-Phong (Blinn 1977), of which the paper has nothing. Normals come from `orientation`, the light is at the camera.
// LIT is set where there may be a light.

#define_import_path bevy_contextual_ao::shading

#import bevy_contextual_ao::{orientation::{Cut, Surface, orientation_at}, volume_bindings::volume}

// Blinn-Phong coefficients.
const AMBIENT: f32 = 0.3;
const DIFFUSE: f32 = 0.7;
const SPECULAR: f32 = 0.2;
const SHININESS: f32 = 16.0;

// How a surface differs from matter without one: in what it shows of its colour, and by a highlight.
fn lit_surface(surface: Surface, direction: vec3<f32>) -> vec2<f32> {
    let is_there = dot(surface.inward, surface.inward) > 0.0;
    let cosine = select(1.0, abs(dot(surface.inward, direction)), is_there);
    let strength = select(0.0, surface.strength, is_there);
    return strength * vec2(DIFFUSE * (cosine - 1.0), SPECULAR * pow(cosine, SHININESS));
}

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
    // Light of both surfaces is blended, not their directions: at a rim the mean direction faces the viewer more than both.
    let orientation = orientation_at(p, cut);
    let lit = lit_surface(orientation.own, direction) + lit_surface(orientation.cut, direction);
    return volume.exposure * (color * (AMBIENT + DIFFUSE + lit.x) * ambient + lit.y);
#else
    return volume.exposure * color * ambient;
#endif
}
