// Prefix sums of opacities along one axis: a third of the 3D summed-area table (Díaz et al. 2010). Sums along x are summed
// along y, and these along z. A voxel's word is then the sum over all voxels with no larger index along any axis.
//
// Opacities are whole numbers of 255ths, so sums are exact. Sums beyond 32 bits wrap around. Differences of these are exact
// where the true difference has 32 bits.

#import bevy_contextual_ao::{
    bricks::{WIDTH, invocation_index},
    volume_bindings::voxel_index,
}

@group(1) @binding(0) var opacities: texture_3d<f32>;
@group(1) @binding(1) var<storage, read_write> table: array<u32>;

@compute @workgroup_size(WIDTH)
fn sum_along_axis(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let line = invocation_index(id, groups);
    // Not those of the volume's uniform, as the loop ends by them alone (2 in docs/drivers.md).
    let dimensions = textureDimensions(opacities);
    // Neighbouring invocations follow neighbouring lines.
    let near = select(0u, 1u, #{AXIS}u == 0u);
    let far = select(2u, 1u, #{AXIS}u == 2u);
    if line >= dimensions[near] * dimensions[far] {
        return;
    }
    var voxel = vec3(0u);
    voxel[near] = line % dimensions[near];
    voxel[far] = line / dimensions[near];
    var sum = 0u;
    for (var place = 0u; place < dimensions[#{AXIS}u]; place += 1u) {
        voxel[#{AXIS}u] = place;
        let index = voxel_index(voxel);
#if AXIS == 0
        sum += u32(round(255.0 * textureLoad(opacities, voxel, 0).r));
#else
        sum += table[index];
#endif
        table[index] = sum;
    }
}
