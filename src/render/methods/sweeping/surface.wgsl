// The distance field as view rays read it: of every voxel the unit gradient of the signed distance, volume space, and
// the distance, mm. The gradient is the surface's normal (Singh, Yuksel, House 2009, section 3). In a sheared grid the
// distance is a lower bound, because sweeps take the axes for perpendicular.

#import bevy_contextual_ao::{
    sweeping::sweeping,
    volume_bindings::{volume, voxel_index},
}

@group(1) @binding(6) var<storage, read> signed_distances: array<f32>;
@group(1) @binding(10) var surface: texture_storage_3d<rgba16float, write>;

// Largest distance that is stored in 16 bits, mm.
const FARTHEST: f32 = 6e4;

// Beyond the grid the distance is that of the nearest voxel.
fn distance_at(place: vec3<i32>) -> f32 {
    let voxel = clamp(place, vec3(0), vec3<i32>(volume.dimensions) - 1);
    return clamp(signed_distances[voxel_index(vec3<u32>(voxel))], -FARTHEST, FARTHEST);
}

@compute @workgroup_size(4, 4, 4)
fn collect_surface(@builtin(global_invocation_id) voxel: vec3<u32>) {
    if any(voxel >= volume.dimensions) {
        return;
    }
    let here = vec3<i32>(voxel);
    let x = vec3(1, 0, 0);
    let y = vec3(0, 1, 0);
    let z = vec3(0, 0, 1);
    let differences = vec3(
        distance_at(here + x) - distance_at(here - x),
        distance_at(here + y) - distance_at(here - y),
        distance_at(here + z) - distance_at(here - z),
    );
    let steps = min(here + 1, vec3<i32>(volume.dimensions) - 1) - max(here - 1, vec3(0));
    let per_voxel = differences / vec3<f32>(max(steps, vec3(1)));
    let per_texture = per_voxel * vec3<f32>(volume.dimensions);
    let gradient = (transpose(volume.texture_from_local) * vec4(per_texture, 0.0)).xyz;
    let steepness = length(gradient);
    let normal = select(vec3(0.0), gradient / steepness, steepness > 0.0);
    textureStore(surface, voxel, vec4(normal, sweeping.least_stretch * distance_at(here)));
}
