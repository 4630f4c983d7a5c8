// Density of a voxel after clipping, for the methods that compute the occlusion of all voxels. They bind the opacities
// first, and the settings of the passes over a volume as `clip_pass` does.

#define_import_path bevy_contextual_ao::density

#import bevy_contextual_ao::{
    brick_bindings::carvers_near_brick,
    coverage::clip_voxel,
    volume_bindings::intensities,
}

@group(1) @binding(0) var opacities: texture_3d<f32>;

// Opacity of one occlusion step.
fn clipped_opacity(voxel: vec3<u32>) -> f32 {
    return textureLoad(opacities, voxel, 0).r;
}

// The share of a voxel that is not clipped.
fn coverage_of(voxel: vec3<u32>) -> f32 {
    return clip_voxel(vec3<f32>(voxel), carvers_near_brick(voxel / 4u), true).coverage;
}

// Intensity as the texture gives it, mixed with `lowest` by the share that is clipped.
fn clipped_intensity(voxel: vec3<u32>, lowest: f32) -> f32 {
    return mix(lowest, textureLoad(intensities, voxel, 0).r, coverage_of(voxel));
}
