// What the passes over the voxels of a volume share: which bricks they visit and how.

#define_import_path bevy_contextual_ao::occlusion_pass

#import bevy_contextual_ao::volume_bindings::volume

struct OcclusionPass {
    // Bricks of 4x4x4 voxels to visit, x fastest: [first_brick, end_brick).
    first_brick: u32,
    end_brick: u32,
    // 0: as if there were no carvers.
    is_clipped: u32,
    // 0: only voxels of category (b) are cast, 1: all.
    casts_all: u32,
    rays: u32,
    steps: u32,
    // COVERAGE_*
    coverage: u32,
}

const COVERAGE_LINES: u32 = 0u;
const COVERAGE_POINTS: u32 = 1u;
const COVERAGE_CENTER: u32 = 2u;

// As the mask volume V_m of the paper holds them.
const CATEGORY_CLIPPED: f32 = 0.0;
const CATEGORY_AFFECTED: f32 = 0.5;
const CATEGORY_UNAFFECTED: f32 = 1.0;

@group(1) @binding(0) var<uniform> occlusion_pass: OcclusionPass;

// The voxel of an invocation. Workgroups are numbered over x, then y: one dimension of a dispatch
// is limited to 65,535. Beyond the last brick it lies outside the volume.
fn pass_voxel(group: vec3<u32>, groups: vec3<u32>, local: vec3<u32>) -> vec3<u32> {
    let brick = occlusion_pass.first_brick + group.y * groups.x + group.x;
    if brick >= occlusion_pass.end_brick {
        return volume.dimensions;
    }
    let bricks = (volume.dimensions + 3u) / 4u;
    return 4u * vec3(brick % bricks.x, (brick / bricks.x) % bricks.y, brick / (bricks.x * bricks.y)) + local;
}
