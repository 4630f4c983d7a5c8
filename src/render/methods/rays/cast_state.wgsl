// What the passes of a ray cast share: the settings of the frame, and the state of the list of words.

#define_import_path bevy_contextual_ao::cast_state

// Unit in which the factors of a voxel's rays are added up.
const FACTOR_UNIT: f32 = 1.0 / 16777216.0;

// Rays that a frame casts.
struct RayPass {
    // First and end ray, and number of samples of each. Progressive rays go on with ray 0 behind all rays.
    first_ray: u32,
    end_ray: u32,
    all_rays: u32,
    steps: u32,
    // 1: rays end when nothing more can change them. 1: rays leap over empty bricks.
    ends_early: u32,
    leaps: u32,
    // Progressive rays: most weight of earlier factors after a change, of patterns.
    kept: f32,
    // Most words that a slice casts and that a frame casts, and number of slices.
    words_per_slice: u32,
    words_per_frame: u32,
    slices: u32,
}

struct CastState {
    // Place in the list of the first word that waits. Places go on behind the end from the beginning.
    next: u32,
    // Words that this frame casts, first and end, and how many of them a workgroup takes.
    first: u32,
    end: u32,
    words_per_group: u32,
    // Number of words that wait for later frames.
    left: u32,
    // Arguments of the slices' dispatches.
    slices: array<CastSlice>,
}

struct CastSlice {
    groups_x: u32,
    groups_y: u32,
    groups_z: u32,
}
