// Lists the bricks in which something may have changed, in the superbricks that `cull_superbricks` lists, and finds the
// carvers near each brick: the second level of the work lists. Bricks whose clipping may have changed are in front.
// Bricks in which only occlusion may be stale are at the back. A brick that is transparent whatever the carvers do is
// listed only when all bricks are.

#import bevy_contextual_ao::{
    bricks::{CARVER_BITS, brick_center_mm, brick_counts, brick_index, voxel_edges_mm},
    changes::changes,
    clip_test::{clip_box, is_near},
    emptiness::is_brick_transparent,
    clip_pass::{QUEUE_NONE, clip_pass},
    listed::{NOTHING, listed_item},
    superbricks::superbrick_at,
    volume_bindings::{MAX_CARVERS, OPERATION_NONE, carvers, volume},
    work_list::{BACK, FRONT, append},
}

@group(1) @binding(5) var<storage, read_write> near_carvers: array<u32>;

// Voxels that the ranges of bricks take into account (`ranges.wgsl`).
const IN_RANGES: u32 = 3u;
// Dilation texels along a side of a brick up to which they are looked at.
const MOST_TEXELS: i32 = 10;

@compute @workgroup_size(4, 4, 4)
fn cull_bricks(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let superbrick = listed_item(FRONT, group);
    let brick = 4u * superbrick_at(superbrick) + local;
    if superbrick == NOTHING || any(brick >= brick_counts()) {
        return;
    }
    let index = brick_index(brick);
    let center_mm = brick_center_mm(brick);
    // Voxel centres are up to 1.5 voxels from the middle of a brick.
    let half_mm = 1.5 * voxel_edges_mm();
    let clips_mm = volume.brick_radius_mm + volume.footprint_mm;
    // A carver that clips any point of the brick is within its own reach of a voxel centre. So the carvers near a brick
    // differ only where a changed carver affects the brick.
    var near = 0u;
    for (var i = 0u; i < MAX_CARVERS && carvers[i].operation != OPERATION_NONE; i += 1u) {
        if is_near(carvers[i], center_mm, clips_mm) {
            let clipping = clip_box(carvers[i], center_mm, half_mm, volume.brick_radius_mm, MOST_TEXELS);
            near |= u32(clipping.affects_some) << (i % CARVER_BITS);
        }
    }
    near_carvers[index] = near;

    var is_listed = clip_pass.lists_all != 0u;
    // The voxels to be cast depend on the voxels that carvers remove.
    var clips = is_listed || clip_pass.queue != QUEUE_NONE;
    // Points that are not transparent may read voxels of such a brick if they are farther away than ranges tell.
    if !is_listed && volume.deciding_voxels <= IN_RANGES && is_brick_transparent(index) {
        return;
    }
    var is_affected = false;
    // Whether past states hide the brick, and whether present states do.
    var is_hidden = vec2(false);
    for (var k = 0u; k < clip_pass.changes; k += 1u) {
        let clipping = clip_box(changes[k], center_mm, half_mm, volume.brick_radius_mm, MOST_TEXELS);
        is_affected |= clipping.affects_some;
        let is_past = k < clip_pass.past_changes;
        is_hidden |= vec2(clipping.removes_all) & vec2(is_past, !is_past);
        clips |= is_near(changes[k], center_mm, clips_mm);
    }
    is_listed |= is_affected && !all(is_hidden);
    if is_listed {
        append(select(BACK, FRONT, clips), index);
    }
}
