// The masks of voxels (`bricks.wgsl`), for passes that write them.

#define_import_path bevy_contextual_ao::voxel_masks

@group(2) @binding(1) var<storage, read_write> voxel_masks: array<atomic<u32>>;
