// Chebyshev distance of every brick, in bricks, from the nearest brick in which something may be visible. Rays may leap
// that far. Carvers only remove, so rays also leap over bricks that carvers hide.
//
// The distance separates over the axes: distances are found along x, then from these along y, then along z. Distances
// are capped, and a search ends at the first distance that cannot be improved.

#import bevy_contextual_ao::{
    bricks::{HIDDEN, WIDTH, brick_at, brick_counts, brick_index, mask_at, number_of_bricks, invocation_index},
    emptiness::is_brick_transparent,
    volume_bindings::volume,
}

#ifdef OCCUPY
@group(1) @binding(2) var<storage, read> voxel_masks: array<u32>;
@group(1) @binding(3) var found: texture_storage_3d<r32uint, write>;
#else
@group(1) @binding(0) var along_other_axes: texture_3d<u32>;
@group(1) @binding(1) var found: texture_storage_3d<r32uint, write>;
#endif

// Largest distance that is found, bricks.
const FARTHEST: u32 = 15u;

#ifdef OCCUPY
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
#endif

@compute @workgroup_size(WIDTH)
fn find_distances(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let index = invocation_index(id, groups);
    if index >= number_of_bricks() {
        return;
    }
    let brick = brick_at(index);
#ifdef OCCUPY
    let nearest = select(FARTHEST, 0u, !is_brick_transparent(index) && is_seen(brick));
#else
    let place = brick[#{AXIS}u];
    let count = brick_counts()[#{AXIS}u];
    var nearest = textureLoad(along_other_axes, brick, 0).r;
    for (var k = 1u; k < nearest; k += 1u) {
        var neighbor = brick;
        if k <= place {
            neighbor[#{AXIS}u] = place - k;
            nearest = min(nearest, max(k, textureLoad(along_other_axes, neighbor, 0).r));
        }
        if place + k < count {
            neighbor[#{AXIS}u] = place + k;
            nearest = min(nearest, max(k, textureLoad(along_other_axes, neighbor, 0).r));
        }
    }
#endif
    textureStore(found, brick, vec4(nearest, 0u, 0u, 0u));
}
