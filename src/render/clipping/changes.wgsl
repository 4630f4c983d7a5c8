// The carvers that moved, came, or went since the last frame, as past and present states.

#define_import_path bevy_contextual_ao::changes

#import bevy_contextual_ao::{
    clip_test::is_affected,
    clip_pass::clip_pass,
    volume_bindings::Carver,
}

@group(1) @binding(3) var<storage, read> changes: array<Carver>;

// Whether the occlusion of a voxel at a point (volume space, mm) may have changed.
fn is_stale(position_mm: vec3<f32>) -> bool {
    var is_old = clip_pass.is_all_stale != 0u;
    for (var k = 0u; k < clip_pass.changes && !is_old; k += 1u) {
        is_old = is_affected(changes[k], position_mm);
    }
    return is_old;
}
