// What a frame does to a volume: the settings of the passes of step IV over its bricks and voxels.

#define_import_path bevy_contextual_ao::clip_pass

struct ClipPass {
    // 1: every brick is listed, not only those near a change.
    lists_all: u32,
    // 1: every voxel is stale, not only those that a change affects.
    is_all_stale: u32,
    // QUEUE_*
    queue: u32,
    // Carvers in `changes`, and how many of them, the first, are as they were.
    changes: u32,
    past_changes: u32,
    // COVERAGE_*
    coverage: u32,
}

// Which stale voxels are cast without being asked for by a view: none; those that some point of a
// visible cell reads; those that no carver removes; all.
const QUEUE_NONE: u32 = 0u;
const QUEUE_SAMPLEABLE: u32 = 1u;
const QUEUE_VISIBLE: u32 = 2u;
const QUEUE_ALL: u32 = 3u;

const COVERAGE_LINES: u32 = 0u;
const COVERAGE_POINTS: u32 = 1u;
const COVERAGE_CENTER: u32 = 2u;

@group(1) @binding(2) var<uniform> clip_pass: ClipPass;
