// Shadow test volume clipping (CAO paper, section 3.2, equation 1) for any number of carvers. Tests whether a point of
// the volume is removed, and whether it is within reach of removed points.

#define_import_path bevy_contextual_ao::clip_test

#import bevy_contextual_ao::{
    bricks::CARVER_BITS,
    volume_bindings::{
        Carver, MAX_CARVERS, OPERATION_INTERSECT, OPERATION_NONE, OPERATION_REGION, OPERATION_SUBTRACT,
        carvers, depth_maps, dilation_maps, volume,
    },
}

fn to_clip_map(carver: Carver, position_mm: vec3<f32>) -> vec3<f32> {
    let p = vec4(position_mm, 1.0);
    return vec3(
        dot(carver.clip_from_local[0], p),
        dot(carver.clip_from_local[1], p),
        dot(carver.clip_from_local[2], p),
    );
}

fn is_in_unit_square(p: vec2<f32>) -> bool {
    return all(p >= vec2(0.0)) && all(p < vec2(1.0));
}

// Whether a point (clip map space) is inside the mesh: between the surfaces of any of its layers.
// Depths belong to whole texels: they are never interpolated. An empty texel holds near 1, far 0.
fn is_inside(carver: Carver, p: vec3<f32>) -> bool {
    if !is_in_unit_square(p.xy) {
        return false;
    }
    let texel = vec2<u32>(p.xy * volume.depth_map_size);
    for (var layer = carver.first_layer; layer < carver.end_layer; layer += 1u) {
        let depths = textureLoad(depth_maps, texel, layer, 0);
        if depths.r < p.z && p.z < depths.g {
            return true;
        }
    }
    return false;
}

// Whether every carver lets a point (volume space, mm) through. `near` has the bits of all carvers that may not.
fn is_visible(position_mm: vec3<f32>, near: u32) -> bool {
    var rest = near;
    while rest != 0u {
        let first = firstTrailingBit(rest);
        rest &= rest - 1u;
        for (var i = first; i < MAX_CARVERS && carvers[i].operation != OPERATION_NONE; i += CARVER_BITS) {
            let inside = is_inside(carvers[i], to_clip_map(carvers[i], position_mm));
            if inside == (carvers[i].operation == OPERATION_SUBTRACT) {
                return false;
            }
        }
    }
    return true;
}

// Whether a carver may act within a radius of a point (volume space, mm), going by its clip camera's view. An
// intersecting carver acts everywhere, because it removes its outside.
fn is_near(carver: Carver, position_mm: vec3<f32>, radius_mm: f32) -> bool {
    let rows = carver.clip_from_local;
    let margin = radius_mm * vec3(length(rows[0].xyz), length(rows[1].xyz), length(rows[2].xyz));
    let p = to_clip_map(carver, position_mm);
    return carver.operation == OPERATION_INTERSECT || all(p >= -margin) && all(p <= 1.0 + margin);
}

// Whether the region that a carver removes is within the occlusion reach of a voxel's centre.
fn is_affected(carver: Carver, position_mm: vec3<f32>) -> bool {
    if carver.operation == OPERATION_REGION {
        return is_near(carver, position_mm, volume.reach_mm);
    }
    let is_in = is_in_dilation(carver, to_clip_map(carver, position_mm));
    // The maps are made for the longest reach among the volumes, and are as coarse as their texels.
    let is_within = is_in.x && is_near(carver, position_mm, volume.reach_mm);
    return select(!is_in.y, is_within, carver.operation == OPERATION_SUBTRACT);
}

// Clip map space → texels of a carver's dilation map.
fn to_dilation_map(carver: Carver, p: vec2<f32>) -> vec2<f32> {
    return (p * carver.dilation_scale + carver.dilation_offset) * volume.dilation_map_size;
}

// Whether a point (clip map space) lies in a carver's inflated mesh (x), and in its shrunk mesh (y).
fn is_in_dilation(carver: Carver, p: vec3<f32>) -> vec2<bool> {
    let place = to_dilation_map(carver, p.xy);
    if any(place < vec2(0.0)) || any(place >= vec2(volume.dilation_map_size)) {
        return vec2(false);
    }
    let texel = vec2<u32>(place);
    var is_in = vec2(false);
    for (var layer = carver.first_layer; layer < carver.end_layer; layer += 1u) {
        let bounds = textureLoad(dilation_maps, texel, layer, 0);
        is_in |= vec2(bounds.x < p.z && p.z < bounds.y, bounds.z < p.z && p.z < bounds.w);
    }
    return is_in;
}

// Whether a carver may affect any voxel in a box, and whether it removes all of them.
struct BoxClipping {
    affects_some: bool,
    removes_all: bool,
}

// The same tests for all points of a box in volume space (mm), given by its centre, three half edges and the radius of
// a ball around it. A box over `most_texels` or more along a side of the dilation map is judged by `is_near` alone.
fn clip_box(carver: Carver, center_mm: vec3<f32>, half_mm: mat3x3<f32>, radius_mm: f32, most_texels: i32) -> BoxClipping {
    let unknown = BoxClipping(is_near(carver, center_mm, radius_mm + volume.reach_mm), false);
    if carver.operation == OPERATION_REGION {
        return unknown;
    }
    let rows = mat3x3(carver.clip_from_local[0].xyz, carver.clip_from_local[1].xyz, carver.clip_from_local[2].xyz);
    let edges = transpose(rows) * half_mm;
    let half = abs(edges[0]) + abs(edges[1]) + abs(edges[2]);
    let p = to_clip_map(carver, center_mm);
    let first = floor(to_dilation_map(carver, p.xy - half.xy));
    let last = floor(to_dilation_map(carver, p.xy + half.xy));
    let limit = volume.dilation_map_size - 1.0;
    let is_inside_map = all(first >= vec2(0.0)) && all(last <= vec2(limit));
    let low = vec2<i32>(clamp(first, vec2(0.0), vec2(limit)));
    let high = vec2<i32>(clamp(last, vec2(0.0), vec2(limit)));
    if any(high - low >= vec2(most_texels)) {
        return unknown;
    }
    // Whether any point is in the inflated mesh, and whether all points are in the shrunk mesh.
    var some_inflated = false;
    var all_shrunk = is_inside_map;
    for (var y = low.y; y <= high.y; y += 1) {
        for (var x = low.x; x <= high.x; x += 1) {
            var is_in_shrunk = false;
            for (var layer = carver.first_layer; layer < carver.end_layer; layer += 1u) {
                let bounds = textureLoad(dilation_maps, vec2(x, y), layer, 0);
                some_inflated |= bounds.x < p.z + half.z && p.z - half.z < bounds.y;
                is_in_shrunk |= bounds.z < p.z - half.z && p.z + half.z < bounds.w;
            }
            all_shrunk &= is_in_shrunk;
        }
    }
    if carver.operation == OPERATION_INTERSECT {
        return BoxClipping(!all_shrunk, !some_inflated);
    }
    return BoxClipping(some_inflated, all_shrunk);
}
