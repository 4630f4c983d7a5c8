// Superbricks of 4x4x4 bricks: the first level at which passes find what changed.

#define_import_path bevy_contextual_ao::superbricks

#import bevy_contextual_ao::bricks::{brick_counts}

// State of a superbrick.
struct Superbrick {
    // A bit for every brick in which something may be visible, x fastest.
    seen_low: u32,
    seen_high: u32,
    // Number of the last clipping that listed the superbrick.
    listed_in: u32,
}

fn superbrick_counts() -> vec3<u32> {
    return (brick_counts() + 3u) / 4u;
}

fn superbrick_at(index: u32) -> vec3<u32> {
    let counts = superbrick_counts();
    return vec3(index % counts.x, (index / counts.x) % counts.y, index / (counts.x * counts.y));
}

fn superbrick_index(superbrick: vec3<u32>) -> u32 {
    let counts = superbrick_counts();
    return (superbrick.z * counts.y + superbrick.y) * counts.x + superbrick.x;
}
