// Orientation of surfaces, for shading: the gradient of the clipped opacity (V_o). Where only an isosurface is
// drawn, it is the gradient of the distance field (`sweeping/surface.wgsl`). The binding follows those of
// `volume_bindings` and `brick_bindings`.

#define_import_path bevy_contextual_ao::orientation

#import bevy_contextual_ao::volume_bindings::{edge_sampler, volume}

// Direction into the grid through the face that a point lies on; 0 if the point lies on no face.
fn inward_from_face(p: vec3<f32>) -> vec3<f32> {
    let beyond = (abs(p - 0.5) - 0.5) * vec3<f32>(volume.dimensions);
    let nearest = max(beyond.x, max(beyond.y, beyond.z));
    let is_face = beyond == vec3(nearest) & vec3(nearest >= -0.1);
    let face = select(vec3(0.0), -sign(p - 0.5), is_face);
    return (transpose(volume.texture_from_local) * vec4(face, 0.0)).xyz;
}

#ifdef ISOSURFACE
@group(#{VOLUME_BIND_GROUP}) @binding(9) var surface: texture_3d<f32>;

// Signed distance of a point from the surface, mm; in a sheared grid a lower bound.
fn distance_from_surface(p: vec3<f32>) -> f32 {
    return textureSampleLevel(surface, edge_sampler, p, 0.0).w;
}

// Direction into the surface, volume space, of any length.
fn inward(p: vec3<f32>) -> vec3<f32> {
    // A solid cut by the end of the grid faces out of the grid there, wherever the nearest surface is.
    let face = inward_from_face(p);
    return select(-textureSampleLevel(surface, edge_sampler, p, 0.0).xyz, face, dot(face, face) > 0.0);
}
#else
@group(#{VOLUME_BIND_GROUP}) @binding(9) var opacities: texture_3d<f32>;

// Direction towards higher opacity, volume space, longer where the opacity is steeper: 3D Sobel over 26 neighbours.
fn inward(p: vec3<f32>) -> vec3<f32> {
    let texel = 1.0 / vec3<f32>(volume.dimensions);
    var gradient = vec3(0.0);
    for (var k = 0; k < 27; k += 1) {
        let offset = vec3<f32>(vec3(k % 3, (k / 3) % 3, k / 9) - 1);
        let weight = vec3(2.0) - abs(offset);
        let opacity = textureSampleLevel(opacities, edge_sampler, p + offset * texel, 0.0).r;
        gradient += opacity * offset * vec3(weight.y * weight.z, weight.x * weight.z, weight.x * weight.y);
    }
    // Per voxel → per texture coordinate → per mm.
    let per_texture = gradient * vec3<f32>(volume.dimensions);
    return (transpose(volume.texture_from_local) * vec4(per_texture, 0.0)).xyz;
}
#endif
