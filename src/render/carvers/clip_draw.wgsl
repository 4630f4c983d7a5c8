// Step II of the CAO paper (section 3.4): a clip mesh as its clip camera sees it. The paper keeps the mesh's nearest
// and farthest depth. Depth peeling (Everitt 2001) finds the surfaces in between, one in each draw. Depths do not
// depend on facing, so flipped windings and mirrored carvers are no special case.

// Local mesh space → clip map space, of the carver being drawn.
@group(0) @binding(0) var<uniform> clip_from_local: mat4x4<f32>;
#ifdef COMPARE
// Depths of a surface drawn before.
@group(1) @binding(0) var surface: texture_depth_2d;
#endif

struct Fragment {
    // Every draw of a mesh must give a surface the same depth.
    @invariant @builtin(position) position: vec4<f32>,
}

@vertex
fn vertex(@location(0) position: vec3<f32>) -> Fragment {
    let p = (clip_from_local * vec4(position, 1.0)).xyz;
    // Texture rows run downwards, clip space upwards.
    return Fragment(vec4(2.0 * p.x - 1.0, 1.0 - 2.0 * p.y, p.z, 1.0));
}

#ifdef COUNT
// Counts of surfaces along the line of sight, added up by blending: front faces minus back faces, and all faces. With
// COMPARE, only surfaces up to and including `surface` count.
@fragment
fn fragment(in: Fragment, @builtin(front_facing) is_front: bool) -> @location(0) vec2<f32> {
#ifdef COMPARE
    if in.position.z > textureLoad(surface, vec2<u32>(in.position.xy), 0) {
        discard;
    }
#endif
    return vec2(select(-1.0, 1.0, is_front), 1.0);
}
#else
// Depth of the mesh; with COMPARE, only behind `surface`.
@fragment
fn fragment(in: Fragment) -> @builtin(frag_depth) f32 {
#ifdef COMPARE
    if in.position.z <= textureLoad(surface, vec2<u32>(in.position.xy), 0) {
        discard;
    }
#endif
    return in.position.z;
}
#endif
