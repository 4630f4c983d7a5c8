// Light of the scene on a volume, by Bevy's own functions for its standard material (`apply_pbr_lighting`): Lambertian or
// Burley diffuse and GGX specular reflection of directional, point and spot lights, with the shadows of meshes; ambient
// light, environment maps and irradiance volumes, which occlusion darkens.
//
// Light is computed for a part of a ray at a time, at its mean place, so that a ray takes few evaluations.

#define_import_path bevy_contextual_ao::scene_lights

#import bevy_contextual_ao::{orientation::{Orientation, Surface}, view_ray::ViewRay, volume_bindings::volume}
#import bevy_pbr::{
    lighting::perceptualRoughnessToRoughness,
    mesh_types::MESH_FLAGS_SHADOW_RECEIVER_BIT,
    mesh_view_bindings::view,
    pbr_functions::{apply_pbr_lighting, calculate_view},
    pbr_types::pbr_input_new,
}

// A part of a ray is lit once it adds this much opacity to the pixel. A lower value takes more evaluations in translucent
// matter.
const SIGNIFICANT: f32 = 0.1;
// Length of normals. Bevy's diffuse light is no number where rounding makes the cosine to the viewer more than 1.
const BARELY_SHORT: f32 = 0.999999;
// A surface of less weight is left out.
const NEGLIGIBLE: f32 = 0.01;

// A part of a ray that waits to be lit: sums, weighted by the opacity that samples add to the pixel.
struct UnlitPart {
    opacity: f32,
    color: vec3<f32>,
    along_mm: f32,
    ambient: f32,
    // Directions into surfaces, and strengths: of the matter, and of cuts.
    own: vec4<f32>,
    cut: vec4<f32>,
}

const NOTHING_UNLIT: UnlitPart = UnlitPart(0.0, vec3(0.0), 0.0, 0.0, vec4(0.0), vec4(0.0));

// A surface without a direction is none.
fn weighted(surface: Surface, opacity: f32) -> vec4<f32> {
    let is_there = dot(surface.inward, surface.inward) > 0.0;
    return select(vec4(0.0), opacity * surface.strength * vec4(surface.inward, 1.0), is_there);
}

fn with_sample(
    before: UnlitPart,
    opacity: f32,
    color: vec3<f32>,
    along_mm: f32,
    ambient: f32,
    orientation: Orientation,
) -> UnlitPart {
    return UnlitPart(
        before.opacity + opacity,
        before.color + opacity * color,
        before.along_mm + opacity * along_mm,
        before.ambient + opacity * ambient,
        before.own + weighted(orientation.own, opacity),
        before.cut + weighted(orientation.cut, opacity),
    );
}

fn is_significant(part: UnlitPart) -> bool {
    return part.opacity >= SIGNIFICANT;
}

// Normal of a surface towards the viewer, world space. One that faces away, as at outlines, is mirrored in the view plane: a
// normal that just turns away changes little. Without a surface the normal is the direction to the viewer.
fn normal_of(inward: vec3<f32>, to_viewer: vec3<f32>) -> vec3<f32> {
    let outward = -(transpose(volume.local_from_world) * vec4(inward, 0.0)).xyz;
    let size = length(outward);
    let normal = select(to_viewer, outward / size, size > 1e-9);
    return BARELY_SHORT * (normal - 2.0 * min(dot(normal, to_viewer), 0.0) * to_viewer);
}

// Light from a point of a ray towards the viewer. `color` is the base colour, `ambient` the share of indirect light.
fn lit_by_scene(
    ray: ViewRay,
    along_mm: f32,
    color: vec3<f32>,
    ambient: f32,
    own: vec4<f32>,
    cut: vec4<f32>,
) -> vec3<f32> {
    var input = pbr_input_new();
    input.flags = volume.receives_shadows * MESH_FLAGS_SHADOW_RECEIVER_BIT;
    input.is_orthographic = view.clip_from_view[3].w == 1.0;
    input.frag_coord = vec4(ray.place, 0.0, 1.0);
    input.world_position = volume.world_from_local * vec4(ray.near + along_mm * ray.direction, 1.0);
    input.V = calculate_view(input.world_position, input.is_orthographic);
    input.material.base_color = vec4(color, 1.0);
    input.material.perceptual_roughness = volume.perceptual_roughness;
    input.material.reflectance = vec3(volume.reflectance);
    input.diffuse_occlusion = vec3(ambient);
    let roughness = perceptualRoughnessToRoughness(volume.perceptual_roughness);
    // Light of surfaces is blended, not their directions (`shading`). What is left faces the viewer.
    var weights = vec3(own.w, cut.w, max(1.0 - own.w - cut.w, 0.0));
    weights = select(weights, vec3(0.0), weights < vec3(NEGLIGIBLE));
    weights /= weights.x + weights.y + weights.z;
    var light = vec3(0.0);
    while any(weights > vec3(0.0)) {
        let is_own = weights.x > 0.0;
        let is_cut = !is_own && weights.y > 0.0;
        let weight = select(select(weights.z, weights.y, is_cut), weights.x, is_own);
        let inward = select(select(vec3(0.0), cut.xyz, is_cut), own.xyz, is_own);
        weights = select(vec3(0.0, select(weights.yz, vec2(0.0, weights.z), is_cut)), vec3(0.0, weights.yz), is_own);
        weights.z *= f32(is_own || is_cut);
        input.N = normal_of(inward, input.V);
        input.world_normal = input.N;
        // Specular occlusion as Bevy derives it from its own ambient occlusion (Lagarde and de Rousiers 2014).
        let facing = max(dot(input.N, input.V), 0.0001);
        input.specular_occlusion = saturate(pow(facing + ambient, exp2(-16.0 * roughness - 1.0)) - 1.0 + ambient);
        light += weight * apply_pbr_lighting(input).rgb;
    }
    return volume.exposure * light;
}

// Light of a part of a ray, premultiplied by its opacity.
fn light_of(part: UnlitPart, ray: ViewRay) -> vec3<f32> {
    let share = 1.0 / max(part.opacity, 1e-9);
    return part.opacity
        * lit_by_scene(ray, share * part.along_mm, share * part.color, share * part.ambient, share * part.own, share * part.cut);
}
