// Lists the bricks in which clipping may have changed something, and finds the carvers near each:
// the first level of the work lists. A brick that is transparent whatever the carvers do is listed
// only when everything is.

#import bevy_contextual_ao::{
    bricks::{brick_at, brick_center_mm, brick_counts},
    clip_test::is_near,
    emptiness::is_brick_transparent,
    occlusion_pass::{BRICK_CLIPS, QUEUE_NONE, occlusion_pass},
    volume_bindings::{Carver, MAX_CARVERS, OPERATION_NONE, carvers, volume},
    work_list::append,
}

// Carvers that moved, came, or went: as they were and as they are.
@group(1) @binding(3) var<storage, read> changes: array<Carver>;
@group(1) @binding(4) var<storage, read_write> near_carvers: array<u32>;

@compute @workgroup_size(64)
fn cull(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let index = id.y * groups.x * 64u + id.x;
    let bricks = brick_counts();
    if index >= bricks.x * bricks.y * bricks.z {
        return;
    }
    let center_mm = brick_center_mm(brick_at(index));
    let clips_mm = volume.brick_radius_mm + volume.footprint_mm;
    let affects_mm = volume.brick_radius_mm + volume.reach_mm;
    var near = 0u;
    for (var i = 0u; i < MAX_CARVERS && carvers[i].operation != OPERATION_NONE; i += 1u) {
        near |= u32(is_near(carvers[i], center_mm, clips_mm)) << (i & 31u);
    }
    near_carvers[index] = near;

    var is_listed = occlusion_pass.lists_all != 0u;
    // Which voxels are wanted goes by what is hidden.
    var clips = is_listed || occlusion_pass.queue != QUEUE_NONE;
    if !is_listed && is_brick_transparent(index) {
        return;
    }
    for (var k = 0u; k < occlusion_pass.changes; k += 1u) {
        is_listed |= is_near(changes[k], center_mm, affects_mm);
        clips |= is_near(changes[k], center_mm, clips_mm);
    }
    if is_listed {
        append(index | select(0u, BRICK_CLIPS, clips));
    }
}
