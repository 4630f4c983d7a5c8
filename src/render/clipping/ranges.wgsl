// Range of intensities around every brick. It covers all points that read the brick's occlusion. They lie up to one
// voxel beyond its outermost voxel centres. Where 2x2x2 voxels have one factor, they lie up to 1.5 voxels beyond.
// Tricubic intensities there depend on one more voxel, and so do opacities that are means over a voxel.

#import bevy_contextual_ao::{
    bricks::{WIDTH, brick_at, number_of_bricks, invocation_index},
    volume_bindings::{intensities, volume},
}

@group(1) @binding(0) var<storage, read_write> ranges: array<u32>;

@compute @workgroup_size(WIDTH)
fn find_ranges(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let index = invocation_index(id, groups);
    if index >= number_of_bricks() {
        return;
    }
    let margin = i32(volume.occlusion_stride) + 1;
    let first = vec3<i32>(4u * brick_at(index)) - margin;
    let size = 4 + 2 * margin;
    let last = vec3<i32>(volume.dimensions) - 1;
    var lowest = 1.0;
    var highest = 0.0;
    for (var k = 0; k < size * size * size; k += 1) {
        let voxel = first + vec3(k % size, (k / size) % size, k / (size * size));
        let intensity = textureLoad(intensities, clamp(voxel, vec3(0), last), 0).r;
        lowest = min(lowest, intensity);
        highest = max(highest, intensity);
    }
    // Rounded outwards, except values that 16 bits hold exactly: their rounding error is 1e-7 at most.
    let range = vec2(floor(lowest * 65535.0 + 0.01), ceil(highest * 65535.0 - 0.01));
    let bits = vec2<u32>(clamp(range, vec2(0.0), vec2(65535.0)));
    ranges[index] = bits.x | (bits.y << 16u);
}
