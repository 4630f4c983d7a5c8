// Step IV of the CAO paper (section 3.5, algorithm 2): the opacity of every voxel after clipping,
// and which of three categories it is in: (a) clipped, (b) visible and its occlusion affected by
// clipping, (c) unaffected.
//
// Coverage as published: the centre and 8 corners; if they disagree, 32 more points, 41 in all.
// The category differs in two ways from algorithm 2. Whether a voxel is affected is asked at its
// centre alone: the dilation maps already contain the footprint of the coverage samples. And a
// voxel counts as clipped only if one carver removes all of that footprint, not if 9 samples say
// so: between them a probe, or the gap between two carvers, may show points that read the voxel.

#import bevy_contextual_ao::{
    clip_test::{influence_at, is_visible},
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

// Half extent of the box of the first 9 samples, voxels.
const FOOTPRINT: f32 = 1.025;
// Further samples, spread over [-1, 1]^3 voxels.
const MORE_SAMPLES: u32 = 32u;

fn is_visible_at(voxel: vec3<f32>, offset: vec3<f32>) -> u32 {
    return u32(is_visible((volume.local_from_voxel * vec4(voxel + offset, 1.0)).xyz));
}

// Point k of the R3 low-discrepancy sequence (Roberts 2018), in [-1, 1]^3.
fn spread_point(k: u32) -> vec3<f32> {
    let step = vec3(0.8191725133961645, 0.6710436067037893, 0.5497004779019703);
    return 2.0 * fract(vec3(0.5) + f32(k + 1u) * step) - 1.0;
}

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
    let voxel = vec3<f32>(id);
    let opacity = correct_opacity(
        classify_intensity(textureLoad(intensities, id, 0).r).a,
        volume.occlusion_exponent,
    );
    var coverage = 1.0;
    var category = CATEGORY_UNAFFECTED;
    // Farther than the reach from anything removed, all samples are visible.
    let center_mm = (volume.local_from_voxel * vec4(voxel, 1.0)).xyz;
    let influence = influence_at(center_mm);
    if occlusion_pass.is_clipped != 0u && influence.is_affected {
        var visible = u32(is_visible(center_mm));
        for (var corner = 0u; corner < 8u; corner += 1u) {
            let sign = vec3<f32>(vec3(corner & 1u, (corner >> 1u) & 1u, corner >> 2u)) * 2.0 - 1.0;
            visible += is_visible_at(voxel, sign * FOOTPRINT);
        }
        coverage = f32(visible) / 9.0;
        if visible > 0u && visible < 9u {
            for (var k = 0u; k < MORE_SAMPLES; k += 1u) {
                visible += is_visible_at(voxel, spread_point(k));
            }
            coverage = f32(visible) / f32(9u + MORE_SAMPLES);
        }
        category = select(CATEGORY_AFFECTED, CATEGORY_CLIPPED, influence.is_removed);
    }
    textureStore(opacities, id, vec4(opacity * coverage, 0.0, 0.0, 0.0));
    textureStore(categories, id, vec4(category, 0.0, 0.0, 0.0));
}
