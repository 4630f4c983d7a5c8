// Bricks of 4x4x4 voxels: the grain in which passes find what they have to do. Voxels have one bit
// each in masks of two words a brick; the masks of all bricks stand one after the other.

#define_import_path bevy_contextual_ao::bricks

#import bevy_contextual_ao::volume_bindings::volume

// Its occlusion is up to date, or will be when this frame's rays are cast.
const VALID: u32 = 0u;
// It is to be cast in this frame.
const PENDING: u32 = 1u;
// No point that is drawn reads it.
const HIDDEN: u32 = 2u;
const MASKS: u32 = 3u;

// Invocations of a workgroup in passes that visit all bricks, or all voxels.
const WIDTH: u32 = 64u;

fn brick_counts() -> vec3<u32> {
    return (volume.dimensions + 3u) / 4u;
}

fn number_of_bricks() -> u32 {
    let bricks = brick_counts();
    return bricks.x * bricks.y * bricks.z;
}

// The number of an invocation in such a pass; there may be more than there are things to visit.
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

// The brick that contains a point (voxels, the grid being [0, dimensions]), or is next to it.
fn brick_of_point(p: vec3<f32>) -> vec3<u32> {
    return vec3<u32>(clamp(p, vec3(0.0), vec3<f32>(volume.dimensions) - 0.5)) / 4u;
}

// Centre of a brick, volume space, mm.
fn brick_center_mm(brick: vec3<u32>) -> vec3<f32> {
    return (volume.local_from_voxel * vec4(4.0 * vec3<f32>(brick) + 1.5, 1.0)).xyz;
}

// Where a word of a mask is.
fn mask_at(mask: u32, word: u32) -> u32 {
    return mask * 2u * number_of_bricks() + word;
}

// Where masks hold a voxel: the word, and the place in it.
fn mask_word(voxel: vec3<u32>) -> u32 {
    return 2u * brick_index(voxel / 4u) + ((voxel.z >> 1u) & 1u);
}

fn mask_bit(voxel: vec3<u32>) -> u32 {
    return 1u << (((voxel.z & 1u) << 4u) | ((voxel.y & 3u) << 2u) | (voxel.x & 3u));
}

// Voxels of a word along each axis.
const MASK_BLOCK: vec3<u32> = vec3(4u, 4u, 2u);

// The voxels of a box, its first and last included, that are in a block which the box meets.
fn mask_of_box(block: vec3<u32>, low: vec3<u32>, high: vec3<u32>) -> u32 {
    let origin = block * MASK_BLOCK;
    let first = max(low, origin) - origin;
    let more = min(high - origin, MASK_BLOCK - 1u) - first;
    let row = (0xfu >> (3u - more.x)) << first.x;
    let rows = (0x1111u >> (4u * (3u - more.y))) << (4u * first.y);
    let layers = (0x10001u >> (16u * (1u - more.z))) << (16u * first.z);
    return row * rows * layers;
}

// The voxel of a bit, relative to the brick's first voxel or, of an odd word, to its third layer.
fn voxel_of_bit(bit: u32) -> vec3<u32> {
    return vec3(bit & 3u, (bit >> 2u) & 3u, bit >> 4u);
}

fn voxel_of_word(word: u32) -> vec3<u32> {
    return 4u * brick_at(word >> 1u) + vec3(0u, 0u, 2u * (word & 1u));
}

// Steps of a ray from a point until it leaves a box.
fn steps_to_leave(p: vec3<f32>, step: vec3<f32>, lower: vec3<f32>, upper: vec3<f32>) -> f32 {
    let still = abs(step) < vec3(1e-6);
    let bound = select(lower, upper, step > vec3(0.0));
    let steps = select((bound - p) / select(step, vec3(1.0), still), vec3(1e6), still);
    return min(steps.x, min(steps.y, steps.z));
}

// Samples that a ray takes, from this one on, before it leaves the bricks that are nearer than
// `distance` (above 0; bricks, Chebyshev) to that of the point. Point and step in voxels. Where these
// are empty, rounding is harmless: a point's trilinear footprint ends half a voxel before a brick's.
fn samples_within(p: vec3<f32>, step: vec3<f32>, distance: u32) -> u32 {
    let brick = vec3<f32>(brick_of_point(p));
    let lower = 4.0 * (brick - f32(distance - 1u));
    let upper = 4.0 * (brick + f32(distance));
    return u32(clamp(ceil(steps_to_leave(p, step, lower, upper)), 1.0, 1e6));
}
