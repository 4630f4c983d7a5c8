// The words of the bricks in the superbricks that `widen` lists: the carvers near a brick, and its distance from
// anything visible. Rays may leap that far. Carvers only remove, so rays also leap over bricks that carvers hide.
//
// `find_seen` finds the bricks in which something may be visible, a bit each. `find_distances` looks for such bricks up
// to three bricks away. So a change reaches no farther than the next superbrick. Where the transfer function leaves
// nothing farther around, its distance counts (`static_distances.wgsl`).

#import bevy_contextual_ao::{
    bricks::{CARVER_BITS, DISTANCE_SHIFT, HIDDEN, brick_counts, brick_index, mask_at},
    emptiness::{is_brick_transparent, ranges},
    listed::{NOTHING, listed_item},
    superbricks::{Superbrick, superbrick_at, superbrick_counts, superbrick_index},
    work_list::BACK,
}

#ifdef FIND_SEEN
@group(1) @binding(5) var<storage, read> voxel_masks: array<u32>;
@group(1) @binding(6) var<storage, read_write> superbricks: array<Superbrick>;

var<workgroup> seen: array<atomic<u32>, 2>;

@compute @workgroup_size(4, 4, 4)
fn find_seen(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let superbrick = listed_item(BACK, group);
    if superbrick == NOTHING {
        return;
    }
    let brick = 4u * superbrick_at(superbrick) + local;
    if all(brick < brick_counts()) && !is_brick_transparent(brick_index(brick)) && is_seen(brick) {
        atomicOr(&seen[lane >> 5u], 1u << (lane & 31u));
    }
    workgroupBarrier();
    if lane == 0u {
        superbricks[superbrick].seen_low = atomicLoad(&seen[0]);
        superbricks[superbrick].seen_high = atomicLoad(&seen[1]);
    }
}

// Whether any voxel that points of a brick read is not hidden.
fn is_seen(brick: vec3<u32>) -> bool {
    let bricks = vec3<i32>(brick_counts());
    for (var k = 0; k < 27; k += 1) {
        let side = vec3(k % 3, (k / 3) % 3, k / 9) - 1;
        let neighbor = vec3<i32>(brick) + side;
        if any(neighbor < vec3(0)) || any(neighbor >= bricks) {
            continue;
        }
        let word = mask_at(HIDDEN, 2u * brick_index(vec3<u32>(neighbor)));
        let layers = layers_facing(side);
        let shown = vec2(~voxel_masks[word], ~voxel_masks[word + 1u]) & layers;
        if any(shown != vec2(0u)) {
            return true;
        }
    }
    return false;
}

// Mask of the voxels that touch a brick, in its neighbour at a side.
fn layers_facing(side: vec3<i32>) -> vec2<u32> {
    let x = select(select(0x88888888u, 0x11111111u, side.x > 0), 0xffffffffu, side.x == 0);
    let y = select(select(0xf000f000u, 0x000f000fu, side.y > 0), 0xffffffffu, side.y == 0);
    let below = select(select(0u, 0x0000ffffu, side.z > 0), 0xffffffffu, side.z == 0);
    let above = select(select(0xffff0000u, 0u, side.z > 0), 0xffffffffu, side.z == 0);
    return vec2(x & y & below, x & y & above);
}
#else
@group(1) @binding(5) var<storage, read> near_carvers: array<u32>;
@group(1) @binding(6) var<storage, read> superbricks: array<Superbrick>;
@group(1) @binding(7) var static_distances: texture_3d<u32>;
@group(1) @binding(8) var words: texture_storage_3d<r32uint, write>;

// Distance of bricks that have no such brick as near as this, bricks.
const FAR: i32 = 4;

// Whether something may be visible in the bricks of a superbrick and of its neighbours: a bit for each brick of a row
// along x. The superbrick's own bricks are 4 to 7 along each axis.
var<workgroup> rows: array<array<u32, 12>, 12>;

// Invocations of a workgroup.
const WIDTH: u32 = 64u;

@compute @workgroup_size(4, 4, 4)
fn find_distances(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let superbrick = listed_item(BACK, group);
    if superbrick == NOTHING {
        return;
    }
    let place = superbrick_at(superbrick);
    for (var k = lane; k < 144u; k += WIDTH) {
        rows[k / 12u][k % 12u] = row_at(vec3<i32>(place), vec2(k % 12u, k / 12u));
    }
    workgroupBarrier();
    let brick = 4u * place + local;
    if any(brick >= brick_counts()) {
        return;
    }
    var nearest = FAR;
    for (var z = 1 - FAR; z < FAR; z += 1) {
        for (var y = 1 - FAR; y < FAR; y += 1) {
            let row = rows[4 + i32(local.z) + z][4 + i32(local.y) + y];
            // From the nearest bit on either side.
            let right = firstTrailingBit(row >> (4u + local.x));
            let left = countLeadingZeros(row << (27u - local.x));
            let across = i32(min(select(right, 32u, right == 0xffffffffu), left));
            nearest = min(nearest, max(across, max(abs(y), abs(z))));
        }
    }
    let distance = max(u32(nearest), textureLoad(static_distances, brick, 0).r);
    let index = brick_index(brick);
    let word = near_carvers[index] | (ranges[index].y << CARVER_BITS) | (distance << DISTANCE_SHIFT);
    textureStore(words, brick, vec4(word, 0u, 0u, 0u));
}

// A row around a superbrick, given by its place along y and z.
fn row_at(superbrick: vec3<i32>, at: vec2<u32>) -> u32 {
    let counts = vec3<i32>(superbrick_counts());
    let shift = 4u * (at.x & 3u) + 16u * (at.y & 1u);
    var row = 0u;
    for (var x = 0; x < 3; x += 1) {
        let neighbor = superbrick + vec3(x, vec2<i32>(at / 4u)) - 1;
        if all(neighbor >= vec3(0)) && all(neighbor < counts) {
            let index = superbrick_index(vec3<u32>(neighbor));
            let seen = select(superbricks[index].seen_low, superbricks[index].seen_high, (at.y & 2u) != 0u);
            row |= ((seen >> shift) & 0xfu) << (4u * u32(x));
        }
    }
    return row;
}
#endif
