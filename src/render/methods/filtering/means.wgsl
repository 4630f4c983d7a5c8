// Means over [-radius, radius] voxels along one axis: a third of the separable filter of Ruiz et al. (section 3). The
// filter finds the mean of the densities around a voxel, or of their squares. Beyond the grid both are 0.
//
// An invocation follows a line and keeps the sum over the interval. At each voxel one number comes and one goes,
// however wide the interval is. Sums are whole numbers of up to 40 bits and exact, so that nothing drifts. Means are
// rounded to whole numbers of 32 bits: densities to 2^-16 of a 16-bit step, squares to a whole squared step. The
// error is half a unit an axis. Equal values stay equal.

#import bevy_contextual_ao::{
    bricks::{WIDTH, invocation_index},
    voxel_lines::{VoxelLine, filtering, number_of_lines, voxel_line},
}

@group(1) @binding(3) var<storage, read> source: array<u32>;
@group(1) @binding(4) var<storage, read_write> means: array<u32>;

fn value_at(index: u32) -> u32 {
    let value = source[index];
#ifdef OF_DENSITIES
#ifdef SQUARES
    return value * value;
#else
    return value << 16u;
#endif
#else
    return value;
#endif
}

// Sums as low and high word.
fn added(sum: vec2<u32>, value: u32) -> vec2<u32> {
    let low = sum.x + value;
    return vec2(low, sum.y + select(0u, 1u, low < value));
}

fn subtracted(sum: vec2<u32>, value: u32) -> vec2<u32> {
    return vec2(sum.x - value, sum.y - select(0u, 1u, sum.x < value));
}

// Rounded mean of `count` values with this sum, by long division, 16 bits at a time. `count` is at most 255, so that
// the remainder leaves room for 16 bits more.
fn mean_of(sum: vec2<u32>, count: u32) -> u32 {
    let rounded = added(sum, count / 2u);
    let first = (rounded.y << 16u) | (rounded.x >> 16u);
    let second = ((first % count) << 16u) | (rounded.x & 0xffffu);
    return ((first / count) << 16u) | (second / count);
}

@compute @workgroup_size(WIDTH)
fn find_means(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let number = invocation_index(id, groups);
    if number >= number_of_lines(#{AXIS}u) {
        return;
    }
    let line = voxel_line(#{AXIS}u, number);
    let radius = filtering.radii[#{AXIS}u];
    var sum = vec2(0u);
    for (var next = 0u; next < line.length + radius; next += 1u) {
        if next < line.length {
            sum = added(sum, value_at(line.first + next * line.stride));
        }
        if next >= radius {
            // The sum now holds all values around this voxel.
            let voxel = next - radius;
            means[line.first + voxel * line.stride] = mean_of(sum, 2u * radius + 1u);
            if voxel >= radius {
                sum = subtracted(sum, value_at(line.first + (voxel - radius) * line.stride));
            }
        }
    }
}
