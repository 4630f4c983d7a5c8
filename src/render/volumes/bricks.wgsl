// Bricks of 4x4x4 voxels: the units in which passes find their work. Voxels have one bit each in masks of two words a
// brick. In a mask, bricks follow one another.
//
// Carvers near a brick have one bit each, modulo `CARVER_BITS`.

#define_import_path bevy_contextual_ao::bricks

#import bevy_contextual_ao::volume_bindings::volume

// Mask of voxels whose occlusion is up to date, or will be when this frame's rays are cast.
const VALID: u32 = 0u;
// Mask of voxels to be cast in this frame.
const PENDING: u32 = 1u;
// Mask of voxels that no drawn point reads.
const HIDDEN: u32 = 2u;
const MASKS: u32 = 3u;

// Number of bits for the carvers near a brick. The brick's smoothing and its distance share the rest of its word.
const CARVER_BITS: u32 = 24u;
const CARVER_MASK: u32 = 0xffffffu;
const DISTANCE_SHIFT: u32 = 28u;

// Invocations of a workgroup in passes that visit all bricks, or all voxels.
const WIDTH: u32 = 64u;

fn brick_counts() -> vec3<u32> {
    return (volume.dimensions + 3u) / 4u;
}

fn number_of_bricks() -> u32 {
    let bricks = brick_counts();
    return bricks.x * bricks.y * bricks.z;
}

// Number of an invocation in such a pass. There may be more invocations than items to visit.
fn invocation_index(id: vec3<u32>, groups: vec3<u32>) -> u32 {
    return id.y * groups.x * WIDTH + id.x;
}

fn brick_at(index: u32) -> vec3<u32> {
    let bricks = brick_counts();
    return vec3(index % bricks.x, (index / bricks.x) % bricks.y, index / (bricks.x * bricks.y));
}

fn brick_index(brick: vec3<u32>) -> u32 {
    let bricks = brick_counts();
    return (brick.z * bricks.y + brick.y) * bricks.x + brick.x;
}

// The brick that contains a point, or the nearest brick. The point is in voxels, where the grid is [0, dimensions].
fn brick_of_point(p: vec3<f32>) -> vec3<u32> {
    return vec3<u32>(clamp(p, vec3(0.0), vec3<f32>(volume.dimensions) - 0.5)) / 4u;
}

// Edges of a voxel, volume space, mm.
fn voxel_edges_mm() -> mat3x3<f32> {
    return mat3x3(volume.local_from_voxel[0].xyz, volume.local_from_voxel[1].xyz, volume.local_from_voxel[2].xyz);
}

// Centre of a brick, volume space, mm.
fn brick_center_mm(brick: vec3<u32>) -> vec3<f32> {
    return (volume.local_from_voxel * vec4(4.0 * vec3<f32>(brick) + 1.5, 1.0)).xyz;
}

// Index of a word of a mask.
fn mask_at(mask: u32, word: u32) -> u32 {
    return mask * 2u * number_of_bricks() + word;
}

// Place of a voxel in a mask: its word, and its bit.
fn mask_word(voxel: vec3<u32>) -> u32 {
    return 2u * brick_index(voxel / 4u) + ((voxel.z >> 1u) & 1u);
}

fn mask_bit(voxel: vec3<u32>) -> u32 {
    return 1u << (((voxel.z & 1u) << 4u) | ((voxel.y & 3u) << 2u) | (voxel.x & 3u));
}

// Number of voxels of a word along each axis.
const MASK_BLOCK: vec3<u32> = vec3(4u, 4u, 2u);

// Mask of the voxels of a block that lie in a box, first and last included. The box must meet the block.
fn mask_of_box(block: vec3<u32>, low: vec3<u32>, high: vec3<u32>) -> u32 {
    let origin = block * MASK_BLOCK;
    let first = max(low, origin) - origin;
    let more = min(high - origin, MASK_BLOCK - 1u) - first;
    let row = (0xfu >> (3u - more.x)) << first.x;
    let rows = (0x1111u >> (4u * (3u - more.y))) << (4u * first.y);
    let layers = (0x10001u >> (16u * (1u - more.z))) << (16u * first.z);
    return row * rows * layers;
}

// Voxel of a bit, relative to the first voxel of its word. The word starts at the brick's first layer or, if odd, at
// its third.
fn voxel_of_bit(bit: u32) -> vec3<u32> {
    return vec3(bit & 3u, (bit >> 2u) & 3u, bit >> 4u);
}

fn voxel_of_word(word: u32) -> vec3<u32> {
    return 4u * brick_at(word >> 1u) + vec3(0u, 0u, 2u * (word & 1u));
}

// Steps per voxel along each axis; 0 along an axis that a ray does not move along.
fn inverse_step(step: vec3<f32>) -> vec3<f32> {
    let still = abs(step) < vec3(1e-6);
    return select(1.0 / select(step, vec3(1.0), still), vec3(0.0), still);
}

// Number of steps from a point until a ray leaves a box. Lengths are in voxels.
fn steps_to_leave(p: vec3<f32>, inverse: vec3<f32>, lower: vec3<f32>, upper: vec3<f32>) -> f32 {
    let bound = select(lower, upper, inverse > vec3(0.0));
    let steps = select((bound - p) * inverse, vec3(1e6), inverse == vec3(0.0));
    return min(steps.x, min(steps.y, steps.z));
}

// What a ray's leaps share. Along each axis: steps to the next brick, with a sign and without, and steps back to a
// brick's near side. They are those of `steps_to_leave`, with all divisions and comparisons done.
struct Leap {
    to_next: vec3<f32>,
    per_brick: vec3<f32>,
    back: vec3<f32>,
}

// Leaps of a ray with so many steps per voxel.
fn leap_along(inverse: vec3<f32>) -> Leap {
    let per_brick = select(4.0 * abs(inverse), vec3(1e6), inverse == vec3(0.0));
    return Leap(4.0 * inverse, per_brick, min(4.0 * inverse, vec3(0.0)));
}

// The point of the grid nearest to a point on the far sides. Lengths are in bricks.
fn within_bricks(p: vec3<f32>) -> vec3<f32> {
    return min(p, 0.25 * vec3<f32>(volume.dimensions) - 0.125);
}

// Number of samples, from this one on, before a ray leaves the bricks nearer than `distance` to the point's brick.
// `distance` is above 0 (Chebyshev); 1 is the point's brick alone. Lengths are in bricks. Where these bricks are empty,
// rounding is harmless: a point's trilinear footprint ends half a voxel before a brick's.
fn samples_within(p: vec3<f32>, leap: Leap, distance: u32) -> u32 {
    let steps = (floor(within_bricks(p)) - p) * leap.to_next + f32(distance) * leap.per_brick + leap.back;
    // At least 1, so that a loop of leaps ends even where a number is NaN: compiled loops have no guard.
    return max(u32(clamp(ceil(min(steps.x, min(steps.y, steps.z))), 1.0, 1e6)), 1u);
}
