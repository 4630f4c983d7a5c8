// Steps I and V of the CAO paper (sections 3.4 and 3.5): the ambient factor of a voxel, cast along
// a spherical pattern of rays (equations 2 and 3). Step I casts every voxel of the unclipped
// volume; step V casts voxels of category (b), copies the result of step I for (c) and writes 1
// for (a). LAO, the reference, is step V for every voxel. It is one kernel for all three, so equal
// input gives equal bits.

#import bevy_contextual_ao::{
    occlusion_pass::{occlusion_pass, pass_voxel},
    volume_bindings::volume,
}

#ifdef STORE_R8
@group(1) @binding(1) var occlusion: texture_storage_3d<r8unorm, write>;
#else
@group(1) @binding(1) var occlusion: texture_storage_3d<rgba8unorm, write>;
#endif
// Opacities after clipping, V_o.
@group(1) @binding(2) var opacities: texture_3d<f32>;
@group(1) @binding(3) var categories: texture_3d<f32>;
// The unclipped occlusion, V_PAO (not read when every voxel is cast).
@group(1) @binding(4) var unclipped_occlusion: texture_3d<f32>;
// Transparent outside the grid where the device has such samplers, else clamped to the edge.
@group(1) @binding(5) var grid_sampler: sampler;
// Two entries a ray, in texture coordinates: the offset of the first sample and the weight; the
// step between samples.
@group(1) @binding(6) var<storage, read> rays: array<vec4<f32>>;
#ifdef COUNT_WORK
// Voxels cast and samples taken, each as low and high word.
@group(1) @binding(7) var<storage, read_write> work: array<atomic<u32>, 4>;

fn count(counter: u32, amount: u32) {
    let before = atomicAdd(&work[2u * counter], amount);
    if before + amount < before {
        atomicAdd(&work[2u * counter + 1u], 1u);
    }
}
#endif

// Opacity at a point: trilinear, and transparent outside the grid.
fn opacity_at(p: vec3<f32>) -> f32 {
    let opacity = textureSampleLevel(opacities, grid_sampler, p, 0.0).r;
#ifdef GRID_BORDER
    return opacity;
#else
    // Interpolation with a transparent neighbour beyond the outermost voxel centres.
    let half = 0.5 * vec3<f32>(volume.dimensions);
    let overhang = max(abs(p * 2.0 - 1.0) * half - (half - 0.5), vec3(0.0));
    let rest = saturate(1.0 - overhang);
    return opacity * rest.x * rest.y * rest.z;
#endif
}

// Equation 2 with M = steps + 1: the mean transmittance along the ray, the voxel itself included.
fn cast_ray(start: vec3<f32>, step: vec3<f32>) -> f32 {
    var transmittance = 1.0;
    var sum = 1.0;
    for (var i = 0u; i < occlusion_pass.steps; i += 1u) {
        transmittance *= 1.0 - opacity_at(start + f32(i) * step);
        sum += transmittance;
    }
    return sum / f32(occlusion_pass.steps + 1u);
}

@compute @workgroup_size(4, 4, 4)
fn ray_cast(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
) {
    let id = pass_voxel(group, groups, local);
    if any(id >= volume.dimensions) {
        return;
    }
    if occlusion_pass.casts_all == 0u {
        let category = textureLoad(categories, id, 0).r;
        // Stored as bytes, the affected category reads back as 0.5 give or take half a byte.
        if abs(category - 0.5) > 0.25 {
            let unclipped = textureLoad(unclipped_occlusion, id, 0);
            let clipped = vec4(1.0, 0.0, 0.0, 0.0);
            textureStore(occlusion, id, select(unclipped, clipped, category < 0.5));
            return;
        }
    }
    let center = (vec3<f32>(id) + 0.5) / vec3<f32>(volume.dimensions);
    var ambient = 0.0;
    for (var k = 0u; k < occlusion_pass.rays; k += 1u) {
        let first = rays[2u * k];
        ambient += first.w * cast_ray(center + first.xyz, rays[2u * k + 1u].xyz);
    }
    textureStore(occlusion, id, vec4(ambient, 0.0, 0.0, 0.0));
#ifdef COUNT_WORK
    count(0u, 1u);
    count(1u, occlusion_pass.rays * occlusion_pass.steps);
#endif
}
