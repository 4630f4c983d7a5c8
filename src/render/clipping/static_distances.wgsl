// Chebyshev distance of every brick, in bricks, from the nearest brick that the transfer function does not make
// transparent. It bounds the distance that rays may leap from below, because carvers only remove (`distances.wgsl`).
//
// The distance separates over the axes: distances are found along x, then from these along y, then along z. Distances
// are capped, and a search ends at the first distance that cannot be improved.

#import bevy_contextual_ao::{
    bricks::{WIDTH, brick_at, brick_counts, number_of_bricks, invocation_index},
    emptiness::is_brick_transparent,
}

#ifdef OCCUPY
@group(1) @binding(2) var found: texture_storage_3d<r32uint, write>;
#else
@group(1) @binding(0) var along_other_axes: texture_3d<u32>;
@group(1) @binding(1) var found: texture_storage_3d<r32uint, write>;
#endif

// Largest distance that is found, bricks. It has as many bits as a brick's word has for it.
const FARTHEST: u32 = 15u;

@compute @workgroup_size(WIDTH)
fn find_distances(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let index = invocation_index(id, groups);
    if index >= number_of_bricks() {
        return;
    }
    let brick = brick_at(index);
#ifdef OCCUPY
    let nearest = select(0u, FARTHEST, is_brick_transparent(index));
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
