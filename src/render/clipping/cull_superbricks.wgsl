// Lists the superbricks in which a change of carvers may matter: the first level of the work lists. It visits the
// superbricks around the carvers that changed (`clip_pass`). What lies deep inside a carver, before and after, is left
// alone.
//
// `widen` then lists, at the other end of the list, these superbricks with all neighbours: bricks in them may have other
// distances (`distances.wgsl`).

#import bevy_contextual_ao::{
    bricks::{WIDTH, invocation_index, voxel_edges_mm},
    changes::changes,
    clip_pass::clip_pass,
    clip_test::{BoxClipping, clip_box},
    superbricks::{Superbrick, superbrick_counts, superbrick_index},
    volume_bindings::{Carver, volume},
    work_list::{BACK, FRONT, append},
}

@group(1) @binding(6) var<storage, read_write> superbricks: array<Superbrick>;

// Dilation texels along a side of a superbrick up to which they are looked at.
const MOST_TEXELS: i32 = 20;

// Superbrick of an invocation, among those from `first` to `end`.
struct Visited {
    superbrick: vec3<u32>,
    is_any: bool,
}

fn visited(invocation: u32, first: vec3<u32>, end: vec3<u32>) -> Visited {
    let counts = max(end, first) - first;
    let place = vec3(
        invocation % max(counts.x, 1u),
        (invocation / max(counts.x, 1u)) % max(counts.y, 1u),
        invocation / max(counts.x * counts.y, 1u),
    );
    return Visited(first + place, all(counts > vec3(0u)) && place.z < counts.z);
}

@compute @workgroup_size(WIDTH)
fn cull_superbricks(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let here = visited(invocation_index(id, groups), clip_pass.first_superbrick, clip_pass.end_superbrick);
    if !here.is_any {
        return;
    }
    var is_listed = clip_pass.visits_all != 0u;
    let voxel_mm = voxel_edges_mm();
    let center_mm = (volume.local_from_voxel * vec4(16.0 * vec3<f32>(here.superbrick) + 7.5, 1.0)).xyz;
    var is_affected = false;
    // Whether one carver hides the superbrick in its past and in its present state: then the carver stays near all its
    // bricks, and no other carver matters there.
    var is_hidden = false;
    for (var k = 0u; k < clip_pass.changes; k += 1u) {
        let state = clip_superbrick(changes[k], center_mm, voxel_mm);
        is_affected |= state.affects_some;
        // Past and present states come in pairs.
        let present = min(k + clip_pass.past_changes, clip_pass.changes - 1u);
        if state.removes_all && k < clip_pass.past_changes {
            is_hidden |= clip_superbrick(changes[present], center_mm, voxel_mm).removes_all;
        }
    }
    is_listed |= is_affected && !is_hidden;
    if is_listed {
        let index = superbrick_index(here.superbrick);
        superbricks[index].listed_in = clip_pass.clipping;
        append(FRONT, index);
    }
}

fn clip_superbrick(carver: Carver, center_mm: vec3<f32>, voxel_mm: mat3x3<f32>) -> BoxClipping {
    return clip_box(carver, center_mm, 7.5 * voxel_mm, 4.0 * volume.brick_radius_mm, MOST_TEXELS);
}

@compute @workgroup_size(WIDTH)
fn widen(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let counts = superbrick_counts();
    let first = max(clip_pass.first_superbrick, vec3(1u)) - 1u;
    let here = visited(invocation_index(id, groups), first, min(clip_pass.end_superbrick + 1u, counts));
    if !here.is_any {
        return;
    }
    let low = max(here.superbrick, vec3(1u)) - 1u;
    let high = min(here.superbrick + 1u, counts - 1u);
    for (var z = low.z; z <= high.z; z += 1u) {
        for (var y = low.y; y <= high.y; y += 1u) {
            for (var x = low.x; x <= high.x; x += 1u) {
                if superbricks[superbrick_index(vec3(x, y, z))].listed_in == clip_pass.clipping {
                    append(BACK, superbrick_index(here.superbrick));
                    return;
                }
            }
        }
    }
}
