// A list that one pass appends to and that the next is dispatched over, one workgroup an item.

#define_import_path bevy_contextual_ao::work_list

struct WorkList {
    // Arguments of the indirect dispatch: as many rows of `ROW` workgroups as are needed.
    groups_x: atomic<u32>,
    groups_y: atomic<u32>,
    groups_z: u32,
    count: atomic<u32>,
    items: array<u32>,
}

// One dimension of a dispatch is limited to 65,535 workgroups.
const ROW: u32 = 32768u;

@group(2) @binding(0) var<storage, read_write> work_list: WorkList;

fn append(item: u32) {
    let index = atomicAdd(&work_list.count, 1u);
    if index >= arrayLength(&work_list.items) {
        return;
    }
    work_list.items[index] = item;
    atomicMax(&work_list.groups_x, min(index + 1u, ROW));
    atomicMax(&work_list.groups_y, index / ROW + 1u);
}
