// The first step of fast sweeping (Singh, Yuksel, House 2009, section 1.1): signed distances, mm, of voxels next to
// the surface at an isovalue, negative inside. The distance of all other voxels is FAR.
//
// Along an edge of the grid the surface lies where intensities, linear between voxels, cross the isovalue. Where it
// crosses edges along several axes, it counts as the plane through the nearest crossing along each. The plane is
// 1 / sqrt(1/x² + 1/y² + 1/z²) away. A thin remainder counts as on the surface, so that it is not lost.

#import bevy_contextual_ao::{
    density::coverage_of,
    sweeping::{FAR, sweeping},
    volume_bindings::{intensities, volume, voxel_index},
}

@group(1) @binding(5) var<storage, read_write> differences: array<f32>;
@group(1) @binding(6) var<storage, read_write> signed_distances: array<f32>;

// Difference of every voxel's intensity from the isovalue, positive inside. Clipping moves it towards the same
// difference outside. The surface of a cut thus lies where half of a voxel is clipped. The lowest bit is 1 if the
// unclipped voxel is inside and a part of it is left.
@compute @workgroup_size(4, 4, 4)
fn measure_differences(@builtin(global_invocation_id) voxel: vec3<u32>) {
    if all(voxel < volume.dimensions) {
        let inside = sweeping.side * (textureLoad(intensities, voxel, 0).r - sweeping.isovalue);
        let coverage = coverage_of(voxel);
        let difference = inside * select(1.0, 2.0 * coverage - 1.0, inside > 0.0);
        let is_left = (inside > 0.0) & (coverage > 0.0);
        let bits = (bitcast<u32>(difference) & ~1u) | select(0u, 1u, is_left);
        differences[voxel_index(voxel)] = bitcast<f32>(bits);
    }
}

// Whether carvers left a part of a voxel, less than half, and no more of any voxel around it. A flat cut leaves no
// such voxel. Coverage is that of a box two voxels wide, whose far corner is a voxel's centre.
fn is_remainder(voxel: vec3<u32>, here: f32) -> bool {
    if here > 0.0 || (bitcast<u32>(here) & 1u) == 0u {
        return false;
    }
    var most = 0.0;
    for (var k = 0u; k < 27u; k += 1u) {
        // An index below 0 wraps round, and is outside the grid as well.
        let neighbor = voxel + vec3(k % 3u, (k / 3u) % 3u, k / 9u) - 1u;
        if all(neighbor < volume.dimensions) {
            most = max(most, differences[voxel_index(neighbor)]);
        }
    }
    return most <= 0.0;
}

// Share of the way from a voxel to the nearer crossing along an axis; 2 if there is none.
fn way_to_crossing(voxel: vec3<u32>, step: vec3<u32>, here: f32) -> f32 {
    // An index below 0 wraps round, and is outside the grid as well.
    return min(way_to(voxel - step, here), way_to(voxel + step, here));
}

fn way_to(neighbor: vec3<u32>, here: f32) -> f32 {
    var way = 2.0;
    if all(neighbor < volume.dimensions) {
        let there = differences[voxel_index(neighbor)];
        way = select(2.0, here / (here - there), (here > 0.0) != (there > 0.0));
    }
    return way;
}

@compute @workgroup_size(4, 4, 4)
fn initialize_distances(@builtin(global_invocation_id) voxel: vec3<u32>) {
    if all(voxel < volume.dimensions) {
        let index = voxel_index(voxel);
        let here = differences[index];
        let ways = vec3(
            way_to_crossing(voxel, vec3(1u, 0u, 0u), here),
            way_to_crossing(voxel, vec3(0u, 1u, 0u), here),
            way_to_crossing(voxel, vec3(0u, 0u, 1u), here),
        );
        let distances_mm = max(ways, vec3(1e-6)) * sweeping.spacing_mm;
        let closeness = select(1.0 / (distances_mm * distances_mm), vec3(0.0), ways > vec3(1.5));
        let sum = closeness.x + closeness.y + closeness.z;
        var distance_mm = select(FAR, inverseSqrt(max(sum, 1e-30)), sum > 0.0);
        if is_remainder(voxel, here) {
            distance_mm = 0.0;
        }
        signed_distances[index] = select(distance_mm, -distance_mm, here > 0.0);
    }
}
