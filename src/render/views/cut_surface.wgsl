// Orientation of a cut: that of the carver's own surface, from its depth maps. Depths of neighbouring texels give the
// slope of a surface that faces the clip camera. A wall along the camera's line of sight has no depths: it is where texels
// inside the mesh meet texels outside.

#define_import_path bevy_contextual_ao::cut_surface

#import bevy_contextual_ao::{
    bricks::CARVER_BITS,
    clip_test::{is_inside, to_clip_map},
    volume_bindings::{
        Carver, MAX_CARVERS, OPERATION_NONE, OPERATION_SUBTRACT, carvers, depth_maps, volume,
    },
}

// Texels on either side of a point in which a wall is looked for. The more, the less it shows that texels are square.
const WALL_TEXELS: i32 = 3;
// A cut is found to this part of a voxel.
const CUT_ERROR: f32 = 1.0 / 32.0;
// Difference to a depth that does not exist.
const NONE: f32 = 1e9;

// A carver's surface near a point. Its direction leads into the mesh, volume space, and may have any length.
struct CutSurface {
    into_mesh: vec3<f32>,
    distance_mm: f32,
}

// Near or far surface of a texel.
struct Side {
    depth: f32,
    // 1 near, -1 far.
    sign: f32,
}

// Difference from a depth to the nearest depth of a side in a texel; NONE if there is no such side.
fn difference_in(carver: Carver, texel: vec2<i32>, side: Side) -> f32 {
    var nearest = NONE;
    let is_beyond = any(texel < vec2(0)) || any(texel >= vec2(i32(volume.depth_map_size)));
    for (var layer = carver.first_layer; layer < carver.end_layer && !is_beyond; layer += 1u) {
        let depths = textureLoad(depth_maps, texel, layer, 0).rg;
        let difference = select(depths.g, depths.r, side.sign > 0.0) - side.depth;
        if depths.r < depths.g && abs(difference) < abs(nearest) {
            nearest = difference;
        }
    }
    return nearest;
}

// Slope of a surface along an axis of the map. The smaller of two differences does not cross the surface's edge.
fn slope_along(carver: Carver, texel: vec2<i32>, axis: vec2<i32>, side: Side) -> f32 {
    let ahead = difference_in(carver, texel + axis, side);
    let back = -difference_in(carver, texel - axis, side);
    return select(back, ahead, abs(ahead) < abs(back));
}

// Clip map space → volume space, for gradients.
fn gradient_in_volume(carver: Carver, gradient: vec3<f32>) -> vec3<f32> {
    let rows = carver.clip_from_local;
    return gradient.x * rows[0].xyz + gradient.y * rows[1].xyz + gradient.z * rows[2].xyz;
}

// The surface that faces the clip camera, or faces away from it, nearest to a point (clip map space).
fn facing_surface(carver: Carver, p: vec3<f32>) -> CutSurface {
    let texel = vec2<i32>(clamp(p.xy * volume.depth_map_size, vec2(0.0), vec2(volume.depth_map_size - 1.0)));
    var side = Side(NONE, 1.0);
    for (var layer = carver.first_layer; layer < carver.end_layer; layer += 1u) {
        let depths = textureLoad(depth_maps, texel, layer, 0).rg;
        let beyond = abs(depths - p.z);
        let is_near = beyond.x < beyond.y;
        if depths.r < depths.g && min(beyond.x, beyond.y) < abs(side.depth - p.z) {
            side = Side(select(depths.g, depths.r, is_near), select(-1.0, 1.0, is_near));
        }
    }
    if side.depth == NONE {
        return CutSurface(vec3(0.0), NONE);
    }
    let slope = vec2(
        slope_along(carver, texel, vec2(1, 0), side),
        slope_along(carver, texel, vec2(0, 1), side),
    );
    let gradient = gradient_in_volume(carver, vec3(-slope * volume.depth_map_size, 1.0));
    let from_middle = p.xy * volume.depth_map_size - vec2<f32>(texel) - 0.5;
    let distance = abs(p.z - side.depth - dot(slope, from_middle));
    return CutSurface(side.sign * gradient, distance / length(gradient));
}

// Direction into the mesh from a wall around a point (clip map space); 0 if there is none.
fn into_wall(carver: Carver, p: vec3<f32>) -> vec3<f32> {
    var direction = vec2(0.0);
    for (var y = -WALL_TEXELS; y <= WALL_TEXELS; y += 1) {
        for (var x = -WALL_TEXELS; x <= WALL_TEXELS; x += 1) {
            let offset = vec2(f32(x), f32(y));
            let is_in = is_inside(carver, p + vec3(offset / volume.depth_map_size, 0.0));
            // Round, so that it shows less that texels are square.
            let weight = max(1.0 - dot(offset, offset) / f32((WALL_TEXELS + 1) * (WALL_TEXELS + 1)), 0.0);
            direction += select(vec2(0.0), weight * offset, is_in);
        }
    }
    return gradient_in_volume(carver, vec3(direction, 0.0));
}

// Direction away from what carvers removed at a point on a cut, volume space (mm), of any length; 0 if there is no cut.
// `near` has the bits of all carvers that may be there.
fn away_from_cut(position_mm: vec3<f32>, near: u32) -> vec3<f32> {
    var away = vec3(0.0);
    var nearest_mm = NONE;
    var rest = near;
    while rest != 0u {
        let first = firstTrailingBit(rest);
        rest &= rest - 1u;
        for (var i = first; i < MAX_CARVERS && carvers[i].operation != OPERATION_NONE; i += CARVER_BITS) {
            let carver = carvers[i];
            let p = to_clip_map(carver, position_mm);
            // A point beside a wall may lie beyond the map.
            if any(abs(p.xy - 0.5) > vec2(0.5 + f32(WALL_TEXELS) / volume.depth_map_size)) {
                continue;
            }
            let rows = carver.clip_from_local;
            let texel_mm = 1.0 / (volume.depth_map_size * min(length(rows[0].xyz), length(rows[1].xyz)));
            var found = facing_surface(carver, p);
            if found.distance_mm > texel_mm + CUT_ERROR * volume.voxel_mm {
                let wall = into_wall(carver, p);
                found = CutSurface(wall, select(NONE, texel_mm, dot(wall, wall) > 0.0));
            }
            if found.distance_mm < nearest_mm {
                nearest_mm = found.distance_mm;
                away = select(1.0, -1.0, carver.operation == OPERATION_SUBTRACT) * found.into_mesh;
            }
        }
    }
    return away;
}
