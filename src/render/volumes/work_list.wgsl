// A list that a pass appends to and that other passes are dispatched over, one workgroup an item. Its two ends are
// separate lists, which together never have more items than there is room for.

#define_import_path bevy_contextual_ao::work_list

struct Head {
    // Arguments of the indirect dispatch: as many rows of `ROW` workgroups as are needed.
    groups_x: atomic<u32>,
    groups_y: atomic<u32>,
    groups_z: u32,
    count: atomic<u32>,
}

struct WorkList {
    heads: array<Head, 2>,
    items: array<u32>,
}

const FRONT: u32 = 0u;
const BACK: u32 = 1u;

// One dimension of a dispatch is limited to 65,535 workgroups.
const ROW: u32 = 32768u;

@group(2) @binding(0) var<storage, read_write> work_list: WorkList;

fn append(end: u32, item: u32) {
    let room = arrayLength(&work_list.items);
    let index = atomicAdd(&work_list.heads[end].count, 1u);
    // A list whose first items are done goes on in their places.
    let place = index % room;
    work_list.items[select(place, room - 1u - place, end == BACK)] = item;
    atomicMax(&work_list.heads[end].groups_x, min(index + 1u, ROW));
    atomicMax(&work_list.heads[end].groups_y, index / ROW + 1u);
}
