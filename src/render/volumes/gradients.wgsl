// Length of the intensity's gradient, as a number of rows of the lookup table (`classification`). Differences are
// central, over a voxel to either side along each axis. Without BY_GRADIENT it is 0.

#define_import_path bevy_contextual_ao::gradients

#import bevy_contextual_ao::{reconstruction::trilinear_around, volume_bindings::volume}

// The length of a gradient per voxel.
fn gradient_length(per_voxel: vec3<f32>) -> f32 {
#ifdef BY_GRADIENT
    let per_texture = per_voxel * vec3<f32>(volume.dimensions);
    let per_mm = (transpose(volume.texture_from_local) * vec4(per_texture, 0.0)).xyz;
    return min(length(per_mm) * volume.gradient_density, volume.last_gradient_row);
#else
    return 0.0;
#endif
}

// The length at a place, in texture coordinates.
fn gradient_at(p: vec3<f32>) -> f32 {
#ifdef BY_GRADIENT
    let around = trilinear_around(p);
    return gradient_length(0.5 * (around.behind - around.before));
#else
    return 0.0;
#endif
}
