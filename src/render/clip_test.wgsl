// Shadow test volume clipping (CAO paper, section 3.2, equation 1) for any number of carvers: is a
// point of the volume removed, and how is a voxel touched by what is removed?

#define_import_path bevy_contextual_ao::clip_test

#import bevy_contextual_ao::volume_bindings::{
    Carver, OPERATION_SUBTRACT, carvers, depth_maps, dilation_maps, volume,
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

// Whether a point (clip map space) is between the nearest and the farthest surface of the mesh.
// Depths belong to whole texels: they are never interpolated. An empty texel holds near 1, far 0.
fn is_inside(carver: Carver, p: vec3<f32>) -> bool {
    if !is_in_unit_square(p.xy) {
        return false;
    }
    let texel = vec2<u32>(p.xy * volume.depth_map_size);
    let near = textureLoad(depth_maps, texel, 2u * carver.slot, 0);
    let far = textureLoad(depth_maps, texel, 2u * carver.slot + 1u, 0);
    return near < p.z && p.z < far;
}

// Whether every carver lets a point (volume space, mm) through.
fn is_visible(position_mm: vec3<f32>) -> bool {
    for (var i = 0u; i < volume.carver_count; i += 1u) {
        let inside = is_inside(carvers[i], to_clip_map(carvers[i], position_mm));
        if inside == (carvers[i].operation == OPERATION_SUBTRACT) {
            return false;
        }
    }
    return true;
}

// Whether a point lies in the mesh of a carver inflated (x) and shrunk (y).
fn is_in_dilation(carver: Carver, position_mm: vec3<f32>) -> vec2<bool> {
    let p = to_clip_map(carver, position_mm);
    let uv = p.xy * carver.dilation_scale + carver.dilation_offset;
    if !is_in_unit_square(uv) {
        return vec2(false);
    }
    let bounds = textureLoad(dilation_maps, vec2<u32>(uv * volume.dilation_map_size), carver.slot, 0);
    return vec2(bounds.x < p.z && p.z < bounds.y, bounds.z < p.z && p.z < bounds.w);
}

struct Influence {
    // Something that a carver removes is within the occlusion reach of the voxel.
    is_affected: bool,
    // A carver removes every point that can read the voxel.
    is_removed: bool,
}

// How carvers touch the voxel at a point (volume space, mm).
fn influence_at(position_mm: vec3<f32>) -> Influence {
    var influence = Influence(false, false);
    for (var i = 0u; i < volume.carver_count; i += 1u) {
        let is_in = is_in_dilation(carvers[i], position_mm);
        let subtracts = carvers[i].operation == OPERATION_SUBTRACT;
        influence.is_affected |= select(!is_in.y, is_in.x, subtracts);
        influence.is_removed |= select(!is_in.x, is_in.y, subtracts);
    }
    return influence;
}
