// Shadow test volume clipping (CAO paper, section 3.2, equation 1) for any number of carvers: is a
// point of the volume removed, and is it within reach of what is?

#define_import_path bevy_contextual_ao::clip_test

#import bevy_contextual_ao::volume_bindings::{
    Carver, MAX_CARVERS, OPERATION_NONE, OPERATION_SUBTRACT, carvers, depth_maps, dilation_maps, volume,
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

// Whether every carver lets a point (volume space, mm) through.
fn is_visible(position_mm: vec3<f32>) -> bool {
    for (var i = 0u; i < MAX_CARVERS && carvers[i].operation != OPERATION_NONE; i += 1u) {
        let inside = is_inside(carvers[i], to_clip_map(carvers[i], position_mm));
        if inside == (carvers[i].operation == OPERATION_SUBTRACT) {
            return false;
        }
    }
    return true;
}

// Whether a point (clip map space) lies in the mesh of a carver inflated (x) and shrunk (y).
fn is_in_dilation(carver: Carver, p: vec3<f32>) -> vec2<bool> {
    let uv = p.xy * carver.dilation_scale + carver.dilation_offset;
    if !is_in_unit_square(uv) {
        return vec2(false);
    }
    let texel = vec2<u32>(uv * volume.dilation_map_size);
    var is_in = vec2(false);
    for (var layer = carver.first_layer; layer < carver.end_layer; layer += 1u) {
        let bounds = textureLoad(dilation_maps, texel, layer, 0);
        is_in |= vec2(bounds.x < p.z && p.z < bounds.y, bounds.z < p.z && p.z < bounds.w);
    }
    return is_in;
}
