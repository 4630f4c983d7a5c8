// Lists the superbricks in which a change of carvers may matter: the first level of the work lists. It visits the
// superbricks around the carvers that changed (`clip_pass`). What lies deep inside a carver, before and after, is left
// alone.
//
// `widen` then lists, at the other end of the list, these superbricks with all neighbours: bricks in them may have other
// distances (`distances.wgsl`).

#import bevy_contextual_ao::{
    bricks::{WIDTH, invocation_index},
    changes::changes,
    clip_pass::clip_pass,
    clip_test::{clip_box, to_clip_map},
    superbricks::{Superbrick, superbrick_counts, superbrick_index},
    volume_bindings::{Carver, OPERATION_INTERSECT, volume},
    work_list::{BACK, FRONT, append},
}

@group(1) @binding(6) var<storage, read_write> superbricks: array<Superbrick>;

// Dilation texels along a side of a superbrick up to which they are looked at.
const MOST_TEXELS: i32 = 20;
// Margin for rounding, clip map space.
const MARGIN: f32 = 1e-4;

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
    let voxel_mm = mat3x3(
        volume.local_from_voxel[0].xyz,
        volume.local_from_voxel[1].xyz,
        volume.local_from_voxel[2].xyz,
    );
    let center_mm = (volume.local_from_voxel * vec4(16.0 * vec3<f32>(here.superbrick) + 7.5, 1.0)).xyz;
    var is_affected = false;
    // Whether past states hide the superbrick, and whether present states do.
    var is_hidden = vec2(false);
    for (var k = 0u; k < clip_pass.changes; k += 1u) {
        let clipping = clip_box(changes[k], center_mm, 7.5 * voxel_mm, 4.0 * volume.brick_radius_mm, MOST_TEXELS);
        is_affected |= clipping.affects_some;
        let is_past = k < clip_pass.past_changes;
        is_hidden |= vec2(clipping.removes_all) & vec2(is_past, !is_past);
        // The carvers near a brick are found anew where they may differ. Past and present states come in pairs.
        if is_past && k + clip_pass.past_changes < clip_pass.changes {
            let past = nearness(changes[k], center_mm, 6.0 * voxel_mm);
            let present = nearness(changes[k + clip_pass.past_changes], center_mm, 6.0 * voxel_mm);
            is_listed |= !any(past & present);
        }
    }
    is_listed |= is_affected && !all(is_hidden);
    if is_listed {
        let index = superbrick_index(here.superbrick);
        superbricks[index].listed_in = clip_pass.clipping;
        append(FRONT, index);
    }
}

// Whether a carver is certainly near all bricks of a superbrick (`is_near`), and whether it is near none. The middles of
// the bricks lie in a box, given by its centre and half edges.
fn nearness(carver: Carver, center_mm: vec3<f32>, half_mm: mat3x3<f32>) -> vec2<bool> {
    let rows = mat3x3(carver.clip_from_local[0].xyz, carver.clip_from_local[1].xyz, carver.clip_from_local[2].xyz);
    let edges = transpose(rows) * half_mm;
    let half = abs(edges[0]) + abs(edges[1]) + abs(edges[2]);
    let p = to_clip_map(carver, center_mm);
    let near = (volume.brick_radius_mm + volume.footprint_mm) * vec3(length(rows[0]), length(rows[1]), length(rows[2]));
    let is_all = all(p - half >= MARGIN - near) && all(p + half <= 1.0 + near - MARGIN);
    let is_none = any(p + half < -near - MARGIN) || any(p - half > 1.0 + near + MARGIN);
    return select(vec2(is_all, is_none), vec2(true, false), carver.operation == OPERATION_INTERSECT);
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
