// Code shared by the passes of occlusion by filtering: their settings, and the places of an axis line's voxels in
// buffers. A buffer has one number a voxel, x fastest.

#define_import_path bevy_contextual_ao::voxel_lines

struct Filtering {
    // Number of voxels.
    dimensions: vec3<u32>,
    // ESTIMATE_*
    estimate: u32,
    // Half the width of the box around a voxel, without the voxel itself, voxels.
    radii: vec3<u32>,
    // 1: density is intensity. `lowest` is the intensity of density 0, as the texture gives it, and
    // `per_intensity` the density per unit of intensity. Otherwise density is opacity.
    is_of_intensities: u32,
    lowest: f32,
    per_intensity: f32,
    // Multiplier of the factors.
    brightness: f32,
    // Variance or gradient above which a voxel keeps all its opacity.
    threshold: f32,
}

const ESTIMATE_CHEBYSHEV: u32 = 0u;
const ESTIMATE_POWER: u32 = 1u;
const ESTIMATE_GAUSSIAN: u32 = 2u;
const ESTIMATE_CHEBYSHEV_OPEN: u32 = 3u;

// Not a uniform (3 in docs/drivers.md).
@group(1) @binding(1) var<storage, read> filtering: Filtering;

// Distances in a buffer between neighbours along each axis.
fn strides() -> vec3<u32> {
    return vec3(1u, filtering.dimensions.x, filtering.dimensions.x * filtering.dimensions.y);
}

fn number_of_voxels() -> u32 {
    return filtering.dimensions.x * filtering.dimensions.y * filtering.dimensions.z;
}

fn voxel_at(index: u32) -> vec3<u32> {
    let strides = strides();
    return vec3(index % strides.y, (index / strides.y) % filtering.dimensions.y, index / strides.z);
}

// Voxels along an axis: index of the first voxel, distance between neighbours, number of voxels.
struct VoxelLine {
    first: u32,
    stride: u32,
    length: u32,
}

fn number_of_lines(axis: u32) -> u32 {
    return number_of_voxels() / filtering.dimensions[axis];
}

// Neighbouring lines begin at neighbouring voxels. Along y and z neighbouring invocations read neighbouring words.
fn voxel_line(axis: u32, number: u32) -> VoxelLine {
    let strides = strides();
    let near = select(0u, 1u, axis == 0u);
    let far = select(2u, 1u, axis == 2u);
    let count = filtering.dimensions[near];
    let first = (number % count) * strides[near] + (number / count) * strides[far];
    return VoxelLine(first, strides[axis], filtering.dimensions[axis]);
}
