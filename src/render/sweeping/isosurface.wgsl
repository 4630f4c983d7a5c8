// The first step of fast sweeping (Singh, Yuksel, House 2009, section 1.1): signed distances, mm, of voxels next
// to the surface at an isovalue, inside below 0, and FAR of all others.
//
// Along an edge of the grid the surface is where intensities cross the isovalue, linear between voxels. Where
// it crosses edges along several axes, it is taken for the plane through the nearest crossing along each: that
// is 1 / sqrt(1/x² + 1/y² + 1/z²) away. A voxel of which carvers left less than half, and nothing more next to
// it, is on the surface: so that a thin remainder is not lost.

#import bevy_contextual_ao::{
    density::{clipped_intensity, coverage_of},
    sweeping::{FAR, sweeping},
    volume_bindings::{intensities, volume, voxel_index},
}

@group(1) @binding(5) var<storage, read_write> differences: array<f32>;
@group(1) @binding(6) var<storage, read_write> signed_distances: array<f32>;

// How far the intensity of every voxel is inside. What is clipped goes over to the same distance outside, so
// that the surface of a cut is where half of a voxel is clipped.
@compute @workgroup_size(4, 4, 4)
fn measure_differences(@builtin(global_invocation_id) voxel: vec3<u32>) {
    if all(voxel < volume.dimensions) {
        let difference = textureLoad(intensities, voxel, 0).r - sweeping.isovalue;
        let outside = sweeping.isovalue - sweeping.side * abs(difference);
        let clipped = clipped_intensity(voxel, outside);
        differences[voxel_index(voxel)] = sweeping.side * (clipped - sweeping.isovalue);
    }
}

// Whether something is left of a voxel that is inside but for carvers. No branch may depend on the settings: Mesa's
// software driver (22.3) overruns its stack where one depends on a fourth uniform, those of the volume counted.
fn is_remainder(voxel: vec3<u32>) -> bool {
    let difference = textureLoad(intensities, voxel, 0).r - sweeping.isovalue;
    return (sweeping.side * difference > 0.0) & (coverage_of(voxel) > 0.0);
}

// Share of the way from a voxel to the nearer crossing along an axis; 2 if there is none.
fn way_to_crossing(voxel: vec3<u32>, step: vec3<u32>, here: f32) -> f32 {
    // Below 0 it wraps round, to what is no voxel either.
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
        if all(ways > vec3(1.5)) && here <= 0.0 {
            distance_mm = select(distance_mm, 0.0, is_remainder(voxel));
        }
        signed_distances[index] = select(distance_mm, -distance_mm, here > 0.0);
    }
}
