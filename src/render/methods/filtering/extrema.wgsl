// Lowest and highest density over [-radius, radius] voxels along one axis, by the algorithm of van Herk (1992)
// and of Gil and Werman (1993). It takes about three comparisons a voxel, however wide the interval is. Beyond the
// grid densities are 0.
//
// The line is cut into blocks as wide as the interval. An interval is the end of one block and the beginning of the
// next. Its extrema are found by going backwards through the first block and forwards through the second.

#import bevy_contextual_ao::{
    bricks::{WIDTH, invocation_index},
    voxel_lines::{VoxelLine, filtering, number_of_lines, voxel_line},
}

@group(1) @binding(3) var<storage, read> source: array<u32>;
// The low half of a word holds the highest density. The high half holds the complement of the lowest, so that the
// maximum is taken in both.
@group(1) @binding(4) var<storage, read_write> extrema: array<u32>;

// Words of no voxel, and of a voxel beyond the grid.
const NOTHING: u32 = 0u;
const OUTSIDE: u32 = 0xffff0000u;

fn both(a: u32, b: u32) -> u32 {
    return max(a & 0xffff0000u, b & 0xffff0000u) | max(a & 0xffffu, b & 0xffffu);
}

fn value_at(line: VoxelLine, place: i32) -> u32 {
    if place < 0 || place >= i32(line.length) {
        return OUTSIDE;
    }
    let value = source[line.first + u32(place) * line.stride];
#ifdef OF_DENSITIES
    return ((0xffffu - value) << 16u) | value;
#else
    return value;
#endif
}

@compute @workgroup_size(WIDTH)
fn find_extrema(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let number = invocation_index(id, groups);
    if number >= number_of_lines(#{AXIS}u) {
        return;
    }
    let line = voxel_line(#{AXIS}u, number);
    let length = i32(line.length);
    let radius = i32(filtering.radii[#{AXIS}u]);
    // Voxels from `begin` to `end`, whose intervals begin in the block around `begin`.
    for (var begin = 0; begin < length; begin += 2 * radius + 1) {
        let end = min(begin + 2 * radius + 1, length);
        // From the block's end backwards, without the voxels beyond the grid.
        var suffix = select(NOTHING, OUTSIDE, begin + radius >= length);
        for (var place = min(begin + radius, length - 1); place >= begin - radius; place -= 1) {
            suffix = both(suffix, value_at(line, place));
            let voxel = place + radius;
            if voxel < end {
                extrema[line.first + u32(voxel) * line.stride] = suffix;
            }
        }
        // From the next block's beginning forwards.
        var prefix = NOTHING;
        for (var voxel = begin + 1; voxel < end; voxel += 1) {
            prefix = both(prefix, value_at(line, voxel + radius));
            let index = line.first + u32(voxel) * line.stride;
            extrema[index] = both(extrema[index], prefix);
        }
    }
}
