// A sweep of fast occlusion sweeping (Singh, Yuksel, House 2009) over the tiles of one plane. The visibility of an
// octant of directions is V_s(P) = 1/3 sum of V_s τ of the three neighbours on the octant's side (equation 6). The
// same neighbours give the distance field (equation 1).
//
// A workgroup has a tile of 8x8x8 voxels, an invocation a column of the tile. Every turn computes the voxels of a
// diagonal, whose neighbours were computed in the turn before. Workgroup memory passes on the last values of other
// columns. It alternates between two turns, so that a turn needs one barrier. `faces` keeps the light that leaves a
// tile for the next tile. It has a value for every column through the grid along each axis, overwritten by every
// tile on the way.
//
// Tiles are the same for every direction of sweeping. At the grid's far ends they are incomplete, and their part
// outside is empty.
//
// TURNED: the grid is one of cells around the volume (section 4.1), and light comes from octant 7. Opacities or
// distances are interpolated between voxels.

#import bevy_contextual_ao::{
    density::{clipped_opacity, opacities},
    sweeping::{FAR, corner_of, sweeping},
    volume_bindings::{edge_sampler, volume},
}

struct Plane {
    // Octant from which the light comes.
    octant: u32,
    // Sum of the tiles' indices in the order of the sweep.
    number: u32,
    // First two indices of the first workgroup's tile.
    first: vec2<u32>,
}

const TILE: u32 = 8u;
// Number of diagonals of a tile.
const TURNS: u32 = 22u;
const LANES: u32 = 64u;

@group(1) @binding(9) var<uniform> bound_plane: Plane;
// Copy of the plane on which branches may depend (5 in docs/drivers.md).
var<workgroup> plane: Plane;
#ifdef LIGHT
@group(1) @binding(4) var<storage, read_write> faces: array<f32>;
@group(1) @binding(5) var<storage, read_write> found: array<u32>;
var<workgroup> light: array<f32, 128>;
#endif
#ifdef DISTANCES
@group(1) @binding(6) var<storage, read_write> signed_distances: array<f32>;
var<workgroup> near: array<f32, 128>;
#else ifdef BY_DISTANCE
@group(1) @binding(6) var<storage, read> signed_distances: array<f32>;
#endif

// Numbers of voxels or cells along each axis.
fn grid_size() -> vec3<u32> {
#ifdef TURNED
    return sweeping.cells;
#else
    return volume.dimensions;
#endif
}

fn grid_index(place: vec3<u32>) -> u32 {
    let size = grid_size();
    return (place.z * size.y + place.y) * size.x + place.x;
}

fn tile_counts() -> vec3<u32> {
    return (grid_size() + TILE - 1u) / TILE;
}

// The voxel at a place in the order of the sweep, which begins where the light enters.
fn voxel_at(place: vec3<u32>) -> vec3<u32> {
    let flips = (vec3(plane.octant) & vec3(1u, 2u, 4u)) != vec3(0u);
    return select(place, TILE * tile_counts() - 1u - place, flips);
}

#ifdef LIGHT
// Indices in `faces` of the columns along each axis through a voxel.
fn face_indices(place: vec3<u32>) -> vec3<u32> {
    let size = TILE * tile_counts();
    let x = size.y * place.z + place.y;
    let y = size.y * size.z + size.x * place.z + place.x;
    let z = (size.y + size.x) * size.z + size.x * place.y + place.x;
    return vec3(x, y, z);
}

// Adds the visibility of the octant at a voxel to that of other octants.
fn collect(index: u32, visibility: f32) {
    if sweeping.keeps_octants == 1u {
        let byte = u32(saturate(visibility) * 255.0 + 0.5);
        found[2u * index + plane.octant / 4u] |= byte << (8u * (plane.octant % 4u));
    } else {
        let weight = sweeping.weights[plane.octant / 4u][plane.octant % 4u] / 8.0;
        found[index] = bitcast<u32>(bitcast<f32>(found[index]) + weight * visibility);
    }
}
#endif

#ifdef DISTANCES
// Distance from the surface found so far, on either side of it.
fn distance_at(place: vec3<u32>) -> f32 {
    let voxel = voxel_at(place);
    var distance = FAR;
    if all(voxel < grid_size()) {
        distance = abs(signed_distances[grid_index(voxel)]);
    }
    return distance;
}

// Distance from the distances a of the neighbours along the three axes: equation 1, for unequal spacings h. The result
// d satisfies the sum of ((d - a) / h)² = 1 over the neighbours that are nearer than d.
fn distance_beyond(neighbors: vec3<f32>) -> f32 {
    let h = sweeping.spacing_mm;
    var a = vec2(neighbors.x, h.x);
    var b = vec2(neighbors.y, h.y);
    var c = vec2(neighbors.z, h.z);
    if b.x < a.x { let t = a; a = b; b = t; }
    if c.x < b.x { let t = b; b = c; c = t; }
    if b.x < a.x { let t = a; a = b; b = t; }
    // Distances relative to the nearest neighbour's.
    b.x -= a.x;
    c.x -= a.x;
    var sums = vec3(1.0 / (a.y * a.y), 0.0, -1.0);
    var beyond = a.y;
    if beyond > b.x {
        sums += vec3(1.0, b.x, b.x * b.x) / (b.y * b.y);
        beyond = larger_root(sums);
        if beyond > c.x {
            sums += vec3(1.0, c.x, c.x * c.x) / (c.y * c.y);
            beyond = larger_root(sums);
        }
    }
    return a.x + beyond;
}

// Larger root of s.x t² - 2 s.y t + s.z = 0.
fn larger_root(s: vec3<f32>) -> f32 {
    return (s.y + sqrt(max(s.y * s.y - s.x * s.z, 0.0))) / s.x;
}
#endif

#ifdef BY_DISTANCE
// Opaque share at a signed distance from the surface: equation 7.
fn opaque_at(distance_mm: f32) -> f32 {
    return 1.0 - saturate(distance_mm / sweeping.fade_mm + 0.5);
}
#else
// Opaque share of a way through a voxel or a cell, from the opacity of an occlusion step.
fn opaque_through(opacity: f32) -> f32 {
    let clear = 1.0 - opacity;
    return 1.0 - select(0.0, pow(clear, sweeping.transmittance_exponent), clear > 0.0);
}
#endif

#ifdef TURNED
// Opaque share at the centre of a cell.
fn opaque_share(cell: vec3<u32>) -> f32 {
    let place = (sweeping.voxel_from_cell * vec4(vec3<f32>(cell), 1.0)).xyz;
    let size = vec3<f32>(volume.dimensions);
    if any(place < vec3(-0.5)) || any(place > size - 0.5) {
        return 0.0;
    }
#ifdef BY_DISTANCE
    var distance_mm = 0.0;
    for (var k = 0u; k < 8u; k += 1u) {
        let corner = corner_of(place, volume.dimensions, k);
        distance_mm += corner.weight * signed_distances[corner.index];
    }
    return opaque_at(distance_mm);
#else
    return opaque_through(textureSampleLevel(opacities, edge_sampler, (place + 0.5) / size, 0.0).r);
#endif
}
#else
// Opaque share of a voxel. Sweeps find only distances beyond half of the width over which light fades, so that this share is
// known from the beginning.
fn opaque_share(voxel: vec3<u32>) -> f32 {
#ifdef BY_DISTANCE
    return opaque_at(signed_distances[grid_index(voxel)]);
#else
    return opaque_through(clipped_opacity(voxel));
#endif
}
#endif

// Share of the light that a voxel or a cell lets through: equation 8.
fn transmittance(place: vec3<u32>) -> f32 {
    return 1.0 - opaque_share(place) * sweeping.opacity;
}

@compute @workgroup_size(8, 8, 1)
fn sweep(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_id) column: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    if lane == 0u {
        plane = bound_plane;
    }
    workgroupBarrier();
    let tile = plane.first + group.xy;
    // A layer below 0 wraps round.
    let layer = plane.number - tile.x - tile.y;
    let origin = TILE * vec3(tile, layer);
    // Light and distance that the previous voxel in the column passed on.
    var light_along = 1.0;
    var near_along = FAR;
    for (var turn = 0u; turn < TURNS; turn += 1u) {
        let here = LANES * (turn & 1u) + lane;
        let before = LANES - LANES * (turn & 1u) + lane;
        let local = vec3(column.xy, turn - column.x - column.y);
        // Workgroups without a tile go through the turns, too.
        if local.z < TILE && layer < tile_counts().z {
            let place = origin + local;
            let voxel = voxel_at(place);
            let is_inside = all(voxel < grid_size());
#ifdef LIGHT
            let columns = face_indices(place);
            var arriving = vec3(1.0, 1.0, light_along);
            if local.x > 0u {
                arriving.x = light[before - 1u];
            } else if place.x > 0u {
                arriving.x = faces[columns.x];
            }
            if local.y > 0u {
                arriving.y = light[before - TILE];
            } else if place.y > 0u {
                arriving.y = faces[columns.y];
            }
            if local.z == 0u && place.z > 0u {
                arriving.z = faces[columns.z];
            }
            light_along = 1.0;
            if is_inside {
                let visibility = (arriving.x + arriving.y + arriving.z) / 3.0;
                collect(grid_index(voxel), visibility);
                light_along = visibility * transmittance(voxel);
            }
            light[here] = light_along;
            if local.x == TILE - 1u {
                faces[columns.x] = light_along;
            }
            if local.y == TILE - 1u {
                faces[columns.y] = light_along;
            }
            if local.z == TILE - 1u {
                faces[columns.z] = light_along;
            }
#endif
#ifdef DISTANCES
            var neighbors = vec3(FAR, FAR, near_along);
            if local.x > 0u {
                neighbors.x = near[before - 1u];
            } else if place.x > 0u {
                neighbors.x = distance_at(place - vec3(1u, 0u, 0u));
            }
            if local.y > 0u {
                neighbors.y = near[before - TILE];
            } else if place.y > 0u {
                neighbors.y = distance_at(place - vec3(0u, 1u, 0u));
            }
            if local.z == 0u && place.z > 0u {
                neighbors.z = distance_at(place - vec3(0u, 0u, 1u));
            }
            near_along = FAR;
            if is_inside {
                let index = grid_index(voxel);
                let known = signed_distances[index];
                near_along = abs(known);
                let beyond = distance_beyond(neighbors);
                if beyond < near_along {
                    near_along = beyond;
                    signed_distances[index] = select(beyond, -beyond, known < 0.0);
                }
            }
            near[here] = near_along;
#endif
        }
        workgroupBarrier();
    }
}
