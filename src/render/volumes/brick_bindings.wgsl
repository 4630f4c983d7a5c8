// The words of bricks, for the passes that read them: carvers that may clip a brick, the effect of the tricubic filter in
// it, and its distance from anything visible. The binding follows those of `volume_bindings`.

#define_import_path bevy_contextual_ao::brick_bindings

#import bevy_contextual_ao::{
    bricks::{CARVER_BITS, CARVER_MASK, DISTANCE_SHIFT, brick_of_point, within_bricks},
    volume_bindings::volume,
}

// Bit k: a carver whose number is k modulo CARVER_BITS may clip points of the brick, or change a voxel's opacity. The
// bits above: the brick's smoothing (`ranges.wgsl`). From DISTANCE_SHIFT on: Chebyshev distance, in bricks, to a brick in
// which something may be visible, or less; 0 in such bricks.
@group(#{VOLUME_BIND_GROUP}) @binding(7) var brick_words: texture_3d<u32>;

fn carvers_near_brick(brick: vec3<u32>) -> u32 {
    return (textureLoad(brick_words, brick, 0).r & CARVER_MASK) | volume.tests_all_carvers;
}

fn carvers_near(p: vec3<f32>) -> u32 {
    return carvers_near_brick(brick_of_point(p));
}

// The word of the brick that contains a point, or of the nearest brick. The point is in bricks.
fn brick_word(p: vec3<f32>) -> u32 {
    return textureLoad(brick_words, vec3<u32>(within_bricks(p)), 0).r;
}

fn distance_of(word: u32) -> u32 {
    return word >> DISTANCE_SHIFT;
}

// Largest difference between tricubic and trilinear intensities at points of a brick.
fn smoothing_of(word: u32) -> f32 {
    return exp2(-f32(extractBits(word, CARVER_BITS, DISTANCE_SHIFT - CARVER_BITS)));
}

fn distance_at(p: vec3<f32>) -> u32 {
    return distance_of(brick_word(p));
}
