// A list that an earlier pass has filled (`work_list`), for passes that are dispatched over it.

#define_import_path bevy_contextual_ao::listed

#import bevy_contextual_ao::work_list::{BACK, ROW}

struct ListedHead {
    groups_x: u32,
    groups_y: u32,
    groups_z: u32,
    count: u32,
}

struct List {
    heads: array<ListedHead, 2>,
    items: array<u32>,
}

@group(1) @binding(4) var<storage, read> list: List;

// Item of a workgroup beyond the end of the list.
const NOTHING: u32 = 0xffffffffu;

// The item of a workgroup.
fn listed_item(end: u32, group: vec3<u32>) -> u32 {
    let index = group.y * ROW + group.x;
    if index >= list.heads[end].count {
        return NOTHING;
    }
    return list.items[select(index, arrayLength(&list.items) - 1u - index, end == BACK)];
}
