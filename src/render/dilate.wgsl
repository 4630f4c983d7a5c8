// Step III of the CAO paper (section 3.4, algorithm 1): depth maps of the clip mesh inflated by
// the occlusion reach, a Minkowski sum with an ellipsoid in clip map space. For an intersecting
// carver the mesh is shrunk instead (section 3.2).
//
// The published search over all texels within reach is O(r²) per texel. Here the depth maps are
// first reduced to the extrema of 8x8 tiles; a texel of the dilation map then looks into the few
// tiles that can still improve its bound. The result is exact: the tightest bound that holds for
// every point of a dilation texel.

struct Dilation {
    // Half axes of the ellipsoid, clip map space.
    radii: vec3<f32>,
    slot: u32,
    // Lower corner and size of the dilation frame, clip map space.
    frame_min: vec2<f32>,
    frame_size: vec2<f32>,
    // +1: inflate (subtracting carver), -1: shrink (intersecting carver).
    sign: f32,
}

const TILE: u32 = 8u;
// No surface: farther than any depth, and still far after the reach is added.
const FAR: f32 = 1.0e9;

@group(0) @binding(0) var<uniform> dilation: Dilation;
@group(0) @binding(1) var depth_maps: texture_depth_2d_array;
#ifdef REDUCE
@group(0) @binding(2) var tiles: texture_storage_2d<rg32float, write>;
#else
@group(0) @binding(2) var tiles: texture_2d<f32>;
@group(0) @binding(3) var dilation_maps: texture_storage_2d_array<rg32float, write>;
#endif

// The two bounds as values to be minimised: (near, -far) when inflating, and when shrinking
// (-near, far), where an empty texel shrinks everything around it away.
fn bounds_at(texel: vec2<u32>) -> vec2<f32> {
    let near = textureLoad(depth_maps, texel, 2u * dilation.slot, 0);
    let far = textureLoad(depth_maps, texel, 2u * dilation.slot + 1u, 0);
    let empty = near >= far;
    return select(dilation.sign * vec2(near, -far), vec2(dilation.sign * FAR), empty);
}

#ifdef REDUCE
@compute @workgroup_size(8, 8)
fn reduce(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= textureDimensions(tiles)) {
        return;
    }
    var least = vec2(FAR);
    for (var y = 0u; y < TILE; y += 1u) {
        for (var x = 0u; x < TILE; x += 1u) {
            least = min(least, bounds_at(id.xy * TILE + vec2(x, y)));
        }
    }
    textureStore(tiles, id.xy, vec4(least, 0.0, 0.0));
}
#else

// Half height of the ellipsoid at an offset from its centre given in half axes; -1 beyond it.
fn half_height(offset: vec2<f32>) -> f32 {
    let rest = 1.0 - dot(offset, offset);
    return select(dilation.radii.z * sqrt(rest), -1.0, rest < 0.0);
}

// Distance along each axis between two intervals given by centres and half sizes.
fn gap(a: vec2<f32>, half_a: vec2<f32>, b: vec2<f32>, half_b: vec2<f32>) -> vec2<f32> {
    return max(abs(a - b) - half_a - half_b, vec2(0.0));
}

@compute @workgroup_size(8, 8)
fn dilate(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(dilation_maps).xy;
    if any(id.xy >= size) {
        return;
    }
    let tile_count = textureDimensions(tiles);
    let tile_size = 1.0 / vec2<f32>(tile_count);
    let texel_size = tile_size / f32(TILE);
    let block_size = dilation.frame_size / vec2<f32>(size);
    let block = dilation.frame_min + (vec2<f32>(id.xy) + 0.5) * block_size;
    let half_block = 0.5 * block_size;
    let reach = dilation.radii.xy + half_block;

    var least = vec2(FAR);
    // What lies beyond the depth maps is empty: within reach, it shrinks everything away.
    if dilation.sign < 0.0 && (any(block - reach < vec2(0.0)) || any(block + reach > vec2(1.0))) {
        least = vec2(-FAR);
    }

    let first = vec2<u32>(clamp(floor((block - reach) / tile_size), vec2(0.0), vec2<f32>(tile_count)));
    let last = vec2<u32>(clamp(ceil((block + reach) / tile_size), vec2(0.0), vec2<f32>(tile_count)));
    // A bound that some texel of a tile reaches, wherever it is in the tile.
    for (var y = first.y; y < last.y; y += 1u) {
        for (var x = first.x; x < last.x; x += 1u) {
            let tile = (vec2(f32(x), f32(y)) + 0.5) * tile_size;
            let farthest = (abs(tile - block) + 0.5 * tile_size + half_block) / dilation.radii.xy;
            let height = half_height(farthest);
            if height >= 0.0 {
                least = min(least, textureLoad(tiles, vec2(x, y), 0).xy - height);
            }
        }
    }
    // Only tiles that may hold a better one are searched.
    for (var y = first.y; y < last.y; y += 1u) {
        for (var x = first.x; x < last.x; x += 1u) {
            let tile = (vec2(f32(x), f32(y)) + 0.5) * tile_size;
            let height = half_height(gap(tile, 0.5 * tile_size, block, half_block) / dilation.radii.xy);
            if height < 0.0 || all(textureLoad(tiles, vec2(x, y), 0).xy - height >= least) {
                continue;
            }
            for (var k = 0u; k < TILE * TILE; k += 1u) {
                let texel = vec2(x, y) * TILE + vec2(k % TILE, k / TILE);
                let center = (vec2<f32>(texel) + 0.5) * texel_size;
                let near = half_height(gap(center, 0.5 * texel_size, block, half_block) / dilation.radii.xy);
                if near >= 0.0 {
                    least = min(least, bounds_at(texel) - near);
                }
            }
        }
    }
    // Back to (near, far). Untouched texels hold near > far: nothing is within reach.
    let bounds = dilation.sign * vec2(least.x, -least.y);
    textureStore(dilation_maps, id.xy, dilation.slot, vec4(bounds, 0.0, 0.0));
}
#endif
