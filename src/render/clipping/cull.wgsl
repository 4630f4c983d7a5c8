// Lists the bricks in which something may have changed, and finds the carvers near each brick: the first level of the
// work lists. Bricks whose clipping may have changed are in front. Bricks in which only occlusion may be stale are at
// the back. A brick that is transparent whatever the carvers do is listed only when all bricks are.

#import bevy_contextual_ao::{
    bricks::{WIDTH, brick_at, brick_center_mm, number_of_bricks, invocation_index},
    changes::changes,
    clip_test::{clip_box, is_near},
    emptiness::is_brick_transparent,
    clip_pass::{QUEUE_NONE, clip_pass},
    volume_bindings::{MAX_CARVERS, OPERATION_NONE, carvers, volume},
    work_list::{BACK, FRONT, append},
}

@group(1) @binding(4) var near_carvers: texture_storage_3d<r32uint, write>;

@compute @workgroup_size(WIDTH)
fn cull(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let index = invocation_index(id, groups);
    if index >= number_of_bricks() {
        return;
    }
    let center_mm = brick_center_mm(brick_at(index));
    let clips_mm = volume.brick_radius_mm + volume.footprint_mm;
    var near = 0u;
    for (var i = 0u; i < MAX_CARVERS && carvers[i].operation != OPERATION_NONE; i += 1u) {
        near |= u32(is_near(carvers[i], center_mm, clips_mm)) << (i & 31u);
    }
    textureStore(near_carvers, brick_at(index), vec4(near, 0u, 0u, 0u));

    var is_listed = clip_pass.lists_all != 0u;
    // The voxels to be cast depend on the voxels that carvers remove.
    var clips = is_listed || clip_pass.queue != QUEUE_NONE;
    if !is_listed && is_brick_transparent(index) {
        return;
    }
    // Voxel centres are up to 1.5 voxels from the middle of a brick.
    let half_mm = 1.5 * mat3x3(
        volume.local_from_voxel[0].xyz,
        volume.local_from_voxel[1].xyz,
        volume.local_from_voxel[2].xyz,
    );
    var is_affected = false;
    // Whether past states hide the brick, and whether present states do.
    var is_hidden = vec2(false);
    for (var k = 0u; k < clip_pass.changes; k += 1u) {
        let clipping = clip_box(changes[k], center_mm, half_mm);
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
