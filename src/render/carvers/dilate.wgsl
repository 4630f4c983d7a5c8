// Step III of the CAO paper (section 3.4, algorithm 1): inflates the depth maps of a clip mesh, by a Minkowski sum with
// an ellipsoid in clip map space. For volume probing (section 3.2), it also shrinks them. Every carver gets both. For a
// subtracting carver, the mesh inflated by the occlusion reach contains all voxels that it affects. The mesh shrunk by
// the footprint of a voxel contains the voxels that it certainly removes. For an intersecting carver, reach and
// footprint change places. Layers of one mesh are dilated one by one. Together, inflated layers contain the inflated
// mesh. Shrunk layers are contained in the shrunk mesh.
//
// The published search over all texels within reach is O(r²) per texel. Here the depth maps are first reduced to the
// extrema of 16x16 tiles. Then a workgroup per texel of the dilation map searches the few tiles that can still improve
// its bound. All its invocations search texels of one tile at a time. The result is exact: the tightest bound that
// holds for every point of a dilation texel.

struct Dilation {
    // Half axes of the ellipsoids, clip map space.
    inflation: vec3<f32>,
    layer: u32,
    shrinkage: vec3<f32>,
    // Lower corner and size of the dilation frame, clip map space.
    frame_min: vec2<f32>,
    frame_size: vec2<f32>,
}

const TILE: u32 = 16u;
// No surface: farther than any depth, and still far after the reach is added.
const FAR: f32 = 1.0e9;
// A mesh is inflated by lowering (near, -far), and shrunk by lowering (-near, far).
const INFLATE: f32 = 1.0;
const SHRINK: f32 = -1.0;

@group(0) @binding(0) var<uniform> dilation: Dilation;
@group(0) @binding(1) var depth_maps: texture_2d_array<f32>;
#ifdef REDUCE
@group(0) @binding(2) var tiles: texture_storage_2d<rgba32float, write>;
#else
// Least bounds of each tile: for inflation (xy), for shrinkage (zw).
@group(0) @binding(2) var tiles: texture_2d<f32>;
@group(0) @binding(3) var dilation_maps: texture_storage_2d_array<rgba32float, write>;
#endif

// The two bounds of a texel, as values to be lowered. An empty texel inflates nothing. Shrinkage removes everything
// around an empty texel.
fn bounds_at(texel: vec2<u32>, way: f32) -> vec2<f32> {
    let layer = textureLoad(depth_maps, texel, dilation.layer, 0).rg;
    return select(way * vec2(layer.r, -layer.g), vec2(way * FAR), layer.r >= layer.g);
}

#ifdef REDUCE
@compute @workgroup_size(8, 8)
fn reduce(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= textureDimensions(tiles)) {
        return;
    }
    var least = vec4(FAR);
    for (var k = 0u; k < TILE * TILE; k += 1u) {
        let texel = id.xy * TILE + vec2(k % TILE, k / TILE);
        least = min(least, vec4(bounds_at(texel, INFLATE), bounds_at(texel, SHRINK)));
    }
    textureStore(tiles, id.xy, least);
}
#else

// Half height of an ellipsoid at an offset from its centre; -1 outside the ellipsoid.
fn half_height(offset: vec2<f32>, radii: vec3<f32>) -> f32 {
    let across = offset / radii.xy;
    let rest = 1.0 - dot(across, across);
    return select(radii.z * sqrt(rest), -1.0, rest < 0.0);
}

// Distance along each axis between two intervals given by centres and half sizes.
fn gap(a: vec2<f32>, half_a: vec2<f32>, b: vec2<f32>, half_b: vec2<f32>) -> vec2<f32> {
    return max(abs(a - b) - half_a - half_b, vec2(0.0));
}

fn tile_bounds(tile: vec2<u32>, way: f32) -> vec2<f32> {
    let bounds = textureLoad(tiles, tile, 0);
    return select(bounds.zw, bounds.xy, way == INFLATE);
}

// Invocations of a workgroup.
const WIDTH: u32 = 64u;
// A bit for each of WIDTH tiles: whether the tile is worth a search.
var<workgroup> candidates: array<atomic<u32>, 2>;
var<workgroup> shared_bounds: array<vec2<f32>, WIDTH>;

// The least bounds of all invocations.
fn least_of_all(bounds: vec2<f32>, lane: u32) -> vec2<f32> {
    shared_bounds[lane] = bounds;
    for (var half = WIDTH / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if lane < half {
            shared_bounds[lane] = min(shared_bounds[lane], shared_bounds[lane + half]);
        }
    }
    return workgroupUniformLoad(&shared_bounds[0]);
}

// (near, far) of the mesh inflated or shrunk, over a block of clip map space.
fn dilate_block(block: vec2<f32>, half_block: vec2<f32>, radii: vec3<f32>, way: f32, lane: u32) -> vec2<f32> {
    let tile_count = textureDimensions(tiles);
    let tile_size = 1.0 / vec2<f32>(tile_count);
    let half_tile = 0.5 * tile_size;
    let texel_size = tile_size / f32(TILE);
    let reach = radii.xy + half_block;

    // The tiles within reach, numbered row by row.
    let first = vec2<u32>(clamp(floor((block - reach) / tile_size), vec2(0.0), vec2<f32>(tile_count)));
    let last = vec2<u32>(clamp(ceil((block + reach) / tile_size), vec2(0.0), vec2<f32>(tile_count)));
    let columns = max(last.x - first.x, 1u);
    let count = (last.x - first.x) * (last.y - first.y);

    var least = vec2(FAR);
    // Space beyond the depth maps is empty.
    if way == SHRINK && (any(block - reach < vec2(0.0)) || any(block + reach > vec2(1.0))) {
        least = vec2(-FAR);
    }
    // Bounds that the extreme texel of a tile reaches, wherever it is in the tile.
    for (var k = lane; k < count; k += WIDTH) {
        let tile = first + vec2(k % columns, k / columns);
        let center = (vec2<f32>(tile) + 0.5) * tile_size;
        let height = half_height(abs(center - block) + half_tile + half_block, radii);
        if height >= 0.0 {
            least = min(least, tile_bounds(tile, way) - height);
        }
    }
    least = least_of_all(least, lane);

    // Only tiles that may hold a better bound are searched.
    for (var start = 0u; start < count; start += WIDTH) {
        if lane < 2u {
            atomicStore(&candidates[lane], 0u);
        }
        workgroupBarrier();
        let k = start + lane;
        if k < count {
            let tile = first + vec2(k % columns, k / columns);
            let center = (vec2<f32>(tile) + 0.5) * tile_size;
            let height = half_height(gap(center, half_tile, block, half_block), radii);
            if height >= 0.0 && any(tile_bounds(tile, way) - height < least) {
                atomicOr(&candidates[lane / 32u], 1u << (lane % 32u));
            }
        }
        workgroupBarrier();
        for (var word = 0u; word < 2u; word += 1u) {
            var bits = atomicLoad(&candidates[word]);
            while bits != 0u {
                let found = start + 32u * word + countTrailingZeros(bits);
                bits &= bits - 1u;
                let corner = TILE * (first + vec2(found % columns, found / columns));
                for (var k = lane; k < TILE * TILE; k += WIDTH) {
                    let texel = corner + vec2(k % TILE, k / TILE);
                    let center = (vec2<f32>(texel) + 0.5) * texel_size;
                    let height = half_height(gap(center, 0.5 * texel_size, block, half_block), radii);
                    if height >= 0.0 {
                        least = min(least, bounds_at(texel, way) - height);
                    }
                }
            }
        }
        workgroupBarrier();
    }
    least = least_of_all(least, lane);
    // Where the dilated mesh is empty, near > far.
    return way * vec2(least.x, -least.y);
}

@compute @workgroup_size(WIDTH)
fn dilate(@builtin(workgroup_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let size = textureDimensions(dilation_maps).xy;
    let block_size = dilation.frame_size / vec2<f32>(size);
    let block = dilation.frame_min + (vec2<f32>(id.xy) + 0.5) * block_size;
    let inflated = dilate_block(block, 0.5 * block_size, dilation.inflation, INFLATE, lane);
    let shrunk = dilate_block(block, 0.5 * block_size, dilation.shrinkage, SHRINK, lane);
    if lane == 0u {
        textureStore(dilation_maps, id.xy, dilation.layer, vec4(inflated, shrunk));
    }
}
#endif
