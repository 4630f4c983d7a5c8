// Gradients of the clipped opacity (V_o), for what lights or orients surfaces by them. The binding is one
// more of those of `volume_bindings` and `brick_bindings`.

#define_import_path bevy_contextual_ao::opacity_gradient

#import bevy_contextual_ao::volume_bindings::{edge_sampler, volume}

@group(#{VOLUME_BIND_GROUP}) @binding(9) var opacities: texture_3d<f32>;

// Gradient of the clipped opacity in volume space, up to a factor: 3D Sobel over 26 neighbours.
fn opacity_gradient(p: vec3<f32>) -> vec3<f32> {
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
