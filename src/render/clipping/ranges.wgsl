// Range of intensities around every brick. It covers all points that read the brick's occlusion. They lie less than
// two voxels beyond its outermost voxel centres. Where 2x2x2 voxels have one factor, they lie less than three beyond.
// Trilinear intensities there depend on no more voxels. Tricubic ones, where occlusion is smooth as well, depend on one more
// (`deciding_voxels`).
//
// A brick's smoothing bounds the difference between tricubic and trilinear intensities at its points. Along an axis, a
// point f behind a voxel has a B-spline of ((1-f)^3 a + f^3 b) / 6 more than the linear intensity. Here a and b are the
// second differences of the intensities at the voxels around it. The bound is 1/6 of the largest one, for every axis.

#import bevy_contextual_ao::{
    bricks::{WIDTH, brick_at, number_of_bricks, invocation_index},
    volume_bindings::{intensities, volume},
}

@group(1) @binding(0) var<storage, read_write> ranges: array<vec2<u32>>;

// Largest number for a brick's smoothing. The bound is 2 to the power of minus the number.
const FINEST: f32 = 15.0;
// Share of a brick's range by which filtered samples may be wrong: 8 bits of their fractions, on three axes, for both
// filters.
const FILTER_ERROR: f32 = 1.0 / 64.0;

fn intensity_of(voxel: vec3<i32>) -> f32 {
    return textureLoad(intensities, clamp(voxel, vec3(0), vec3<i32>(volume.dimensions) - 1), 0).r;
}

// Largest second difference along an axis at the voxels that decide the intensities of a brick's points.
fn largest_bend(brick: vec3<u32>, axis: u32) -> f32 {
    let along = vec3<i32>(vec3(axis) == vec3(0u, 1u, 2u));
    let first = vec3<i32>(4u * brick) - 2;
    var largest = 0.0;
    for (var k = 0u; k < 64u; k += 1u) {
        var row = vec3<i32>(vec3(0u, k & 7u, k >> 3u));
        row = select(select(row.yzx, row.yxz, axis == 1u), row, axis == 0u);
        var before = intensity_of(first + row);
        var here = intensity_of(first + row + along);
        for (var n = 2; n < 8; n += 1) {
            let behind = intensity_of(first + row + n * along);
            largest = max(largest, abs(before + behind - 2.0 * here));
            before = here;
            here = behind;
        }
    }
    return largest;
}

@compute @workgroup_size(WIDTH)
fn find_ranges(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let index = invocation_index(id, groups);
    if index >= number_of_bricks() {
        return;
    }
    let margin = i32(volume.occlusion_stride) + 1;
    let first = vec3<i32>(4u * brick_at(index)) - margin;
    let size = 4 + 2 * margin;
    var lowest = 1.0;
    var highest = 0.0;
    for (var k = 0; k < size * size * size; k += 1) {
        let voxel = first + vec3(k % size, (k / size) % size, k / (size * size));
        let intensity = intensity_of(voxel);
        lowest = min(lowest, intensity);
        highest = max(highest, intensity);
    }
    // Rounded outwards, except values that 16 bits hold exactly: their rounding error is 1e-7 at most.
    let range = vec2(floor(lowest * 65535.0 + 0.01), ceil(highest * 65535.0 - 0.01));
    let bits = vec2<u32>(clamp(range, vec2(0.0), vec2(65535.0)));
    let brick = brick_at(index);
    let bends = largest_bend(brick, 0u) + largest_bend(brick, 1u) + largest_bend(brick, 2u);
    let smoothing = bends / 6.0 + (highest - lowest) * FILTER_ERROR;
    let exponent = clamp(floor(-log2(max(smoothing, 1e-9))), 0.0, FINEST);
    ranges[index] = vec2(bits.x | (bits.y << 16u), u32(exponent));
}
