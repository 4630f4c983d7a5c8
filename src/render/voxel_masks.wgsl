// One bit a voxel, for each of three questions: two words a brick, the masks one after the other.

#define_import_path bevy_contextual_ao::voxel_masks

// Its occlusion is up to date, or will be when this frame's rays are cast.
const VALID: u32 = 0u;
// It is to be cast in this frame.
const PENDING: u32 = 1u;
// No point that is drawn reads it.
const HIDDEN: u32 = 2u;

@group(2) @binding(1) var<storage, read_write> voxel_masks: array<atomic<u32>>;

// Where a word of a mask is.
fn mask_at(mask: u32, word: u32) -> u32 {
    return mask * (arrayLength(&voxel_masks) / 3u) + word;
}
