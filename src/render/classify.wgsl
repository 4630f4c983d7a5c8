// Step IV of the CAO paper (section 3.5, algorithm 2): the opacity of every voxel after clipping,
// and which of three categories it is in: (a) clipped, (b) visible and its occlusion affected by
// clipping, (c) unaffected.
//
// The categories differ in two ways from algorithm 2. Whether a voxel is affected is asked at its
// centre alone: the dilation maps already contain the voxel's footprint. And a voxel counts as
// clipped only if one carver removes all of that footprint, not if 9 samples say so: between them a
// probe, or the gap between two carvers, may show points that read the voxel.

#import bevy_contextual_ao::{
    coverage::{Clipping, clip_voxel},
    occlusion_pass::{CATEGORY_AFFECTED, CATEGORY_CLIPPED, CATEGORY_UNAFFECTED, occlusion_pass, pass_voxel},
    volume_bindings::{classify_intensity, correct_opacity, intensities, volume},
}

#ifdef STORE_R8
@group(1) @binding(1) var opacities: texture_storage_3d<r8unorm, write>;
@group(1) @binding(2) var categories: texture_storage_3d<r8unorm, write>;
#else
@group(1) @binding(1) var opacities: texture_storage_3d<rgba8unorm, write>;
@group(1) @binding(2) var categories: texture_storage_3d<rgba8unorm, write>;
#endif

@compute @workgroup_size(4, 4, 4)
fn classify(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
) {
    let id = pass_voxel(group, groups, local);
    if any(id >= volume.dimensions) {
        return;
    }
    let opacity = correct_opacity(
        classify_intensity(textureLoad(intensities, id, 0).r).a,
        volume.occlusion_exponent,
    );
    var clipping = Clipping(1.0, false, false);
    if occlusion_pass.is_clipped != 0u {
        clipping = clip_voxel(vec3<f32>(id));
    }
    var category = select(CATEGORY_UNAFFECTED, CATEGORY_AFFECTED, clipping.is_affected);
    category = select(category, CATEGORY_CLIPPED, clipping.is_removed);
    textureStore(opacities, id, vec4(opacity * clipping.coverage, 0.0, 0.0, 0.0));
    textureStore(categories, id, vec4(category, 0.0, 0.0, 0.0));
}
