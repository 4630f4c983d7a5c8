// Shadow test volume clipping (CAO paper, section 3.2, equation 1) for any number of carvers: is a
// point of the volume removed, and can its occlusion be changed by what is removed?

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

// Whether anything that a carver removes is within the occlusion reach of a point (volume space,
// mm). For a subtracting carver the dilation maps bound the mesh inflated by the reach; for an
// intersecting one they bound the mesh shrunk by it, and everything outside is affected.
fn is_affected(position_mm: vec3<f32>) -> bool {
    for (var i = 0u; i < volume.carver_count; i += 1u) {
        let p = to_clip_map(carvers[i], position_mm);
        let uv = p.xy * carvers[i].dilation_scale + carvers[i].dilation_offset;
        var between = false;
        if is_in_unit_square(uv) {
            let bounds = textureLoad(dilation_maps, vec2<u32>(uv * volume.dilation_map_size), carvers[i].slot, 0).xy;
            between = bounds.x < p.z && p.z < bounds.y;
        }
        if between == (carvers[i].operation == OPERATION_SUBTRACT) {
            return true;
        }
    }
    return false;
}
