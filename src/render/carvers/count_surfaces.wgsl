// The largest number of surfaces of a clip mesh along any line of sight of its clip camera. It decides how often the
// mesh is peeled.

// Front faces minus back faces, and all faces.
@group(0) @binding(0) var counts: texture_2d<f32>;
@group(0) @binding(1) var<storage, read_write> most: atomic<u32>;

// Texels along each side of an invocation's share.
const SHARE: u32 = 16u;

@compute @workgroup_size(8, 8)
fn count_surfaces(@builtin(global_invocation_id) id: vec3<u32>) {
    // The size of the maps is a multiple of SHARE.
    if any(id.xy * SHARE >= textureDimensions(counts)) {
        return;
    }
    var found = 0.0;
    for (var k = 0u; k < SHARE * SHARE; k += 1u) {
        let texel = id.xy * SHARE + vec2(k % SHARE, k / SHARE);
        found = max(found, textureLoad(counts, texel, 0).g);
    }
    atomicMax(&most, u32(found));
}
