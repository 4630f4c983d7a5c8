// Step II of the CAO paper (section 3.4): the depth of a clip mesh as its clip camera sees it.
// Drawn twice, keeping the nearest and then the farthest depth; facing plays no part, so flipped
// windings and mirrored carvers are no special case.

// Local mesh space → clip map space, of the carver being drawn.
@group(0) @binding(0) var<uniform> clip_from_local: mat4x4<f32>;

@vertex
fn vertex(@location(0) position: vec3<f32>) -> @builtin(position) vec4<f32> {
    let p = (clip_from_local * vec4(position, 1.0)).xyz;
    // Texture rows run downwards, clip space upwards.
    return vec4(2.0 * p.x - 1.0, 1.0 - 2.0 * p.y, p.z, 1.0);
}
