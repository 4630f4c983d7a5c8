// Shares the listed words out to the slices of a frame's ray cast: one dispatch each. No slice casts more words than it
// may, and no frame more than its budget. The rest of the list waits for the next frame.

#import bevy_contextual_ao::{
    cast_state::{CastState, RayPass},
    work_list::{FRONT, ROW, WorkList},
}

@group(0) @binding(0) var<uniform> ray_pass: RayPass;
@group(0) @binding(1) var<storage, read_write> words: WorkList;
@group(0) @binding(2) var<storage, read_write> cast_state: CastState;

// Most words of a workgroup, `MOST_WORDS` in `cast.wgsl`. Fewer words make enough workgroups for any device.
const MOST_WORDS: u32 = 8u;
const WORKGROUPS: u32 = 512u;
// Samples of an invocation: some drivers end a loop after 65,535 rounds (docs/drivers.md).
const MOST_SAMPLES: u32 = 60000u;

@compute @workgroup_size(1)
fn share() {
    let count = atomicLoad(&words.heads[FRONT].count);
    let first = cast_state.next;
    let end = first + min(count - first, ray_pass.words_per_frame);
    let samples = max((ray_pass.end_ray - ray_pass.first_ray) * ray_pass.steps, 1u);
    let words_per_group = clamp(min((end - first) / WORKGROUPS, MOST_SAMPLES / samples), 1u, MOST_WORDS);
    cast_state.first = first;
    cast_state.end = end;
    cast_state.words_per_group = words_per_group;
    cast_state.left = count - end;
    cast_state.next = end;
    if end == count {
        cast_state.next = 0u;
        atomicStore(&words.heads[FRONT].count, 0u);
    }
    for (var slice = 0u; slice < ray_pass.slices; slice += 1u) {
        let begin = first + slice * ray_pass.words_per_slice;
        let of_slice = min(max(end, begin) - begin, ray_pass.words_per_slice);
        let groups = (of_slice + words_per_group - 1u) / words_per_group;
        cast_state.slices[slice].groups_x = min(groups, ROW);
        cast_state.slices[slice].groups_y = (groups + ROW - 1u) / ROW;
        cast_state.slices[slice].groups_z = 1u;
    }
}
