// Data of bricks, for the passes that read them: carvers that may clip a brick, and its distance from anything visible.
// The bindings follow those of `volume_bindings`.

#define_import_path bevy_contextual_ao::brick_bindings

#import bevy_contextual_ao::{
    bricks::brick_of_point,
    volume_bindings::volume,
}

// Bit k: a carver whose number is k modulo 32 may clip points of the brick, or change a voxel's opacity.
@group(#{VOLUME_BIND_GROUP}) @binding(7) var near_carvers: texture_3d<u32>;
// Chebyshev distance, in bricks, to the nearest brick in which something may be visible; 0 in such bricks.
@group(#{VOLUME_BIND_GROUP}) @binding(8) var distances: texture_3d<u32>;

fn carvers_near_brick(brick: vec3<u32>) -> u32 {
    return textureLoad(near_carvers, brick, 0).r | volume.tests_all_carvers;
}

fn carvers_near(p: vec3<f32>) -> u32 {
    return carvers_near_brick(brick_of_point(p));
}

fn distance_at(p: vec3<f32>) -> u32 {
    return textureLoad(distances, brick_of_point(p), 0).r;
}
