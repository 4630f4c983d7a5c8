// Settings of the passes of step IV over the bricks and voxels of a volume, for one frame.

#define_import_path bevy_contextual_ao::clip_pass

struct ClipPass {
    // Superbricks that may have changed, first and end, and the number of this clipping of the volume.
    first_superbrick: vec3<u32>,
    clipping: u32,
    end_superbrick: vec3<u32>,
    // 1: every one of these superbricks is visited, not only those near a change.
    visits_all: u32,
    // 1: every brick is listed, not only those near a change.
    lists_all: u32,
    // 1: every voxel is stale, not only those that a change affects.
    is_all_stale: u32,
    // QUEUE_*
    queue: u32,
    // Number of carvers in `changes`, and how many of these are past states. Past states come first.
    changes: u32,
    past_changes: u32,
    // COVERAGE_*
    coverage: u32,
}

// Stale voxels that are cast without the request of a view: none; voxels that some point of a visible cell reads;
// voxels that no carver removes; all.
const QUEUE_NONE: u32 = 0u;
const QUEUE_SAMPLEABLE: u32 = 1u;
const QUEUE_VISIBLE: u32 = 2u;
const QUEUE_ALL: u32 = 3u;

const COVERAGE_LINES: u32 = 0u;
const COVERAGE_POINTS: u32 = 1u;
const COVERAGE_CENTER: u32 = 2u;

@group(1) @binding(2) var<uniform> clip_pass: ClipPass;
