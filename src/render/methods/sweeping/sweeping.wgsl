// Settings that the passes of occlusion sweeping read (Singh, Yuksel, House: Fast Occlusion Sweeping, 2009). The Rust
// side is `resources.rs`.

#define_import_path bevy_contextual_ao::sweeping

struct Sweeping {
    // Weights of octants 0 to 3 and of octants 4 to 7, with a mean of 1. Bit a of an octant's number is set where
    // its directions go to larger indices along axis a.
    weights: array<vec4<f32>, 2>,
    // Distances between voxels, mm.
    spacing_mm: vec3<f32>,
    // Width over which light fades at a surface (h of equation 7), mm.
    fade_mm: f32,
    // A turned grid (section 4.1) through which the light goes: cell index of a voxel index and the reverse, both at
    // centres, and the number of cells.
    cell_from_voxel: mat4x4<f32>,
    voxel_from_cell: mat4x4<f32>,
    cells: vec3<u32>,
    // Length of a voxel, or of a cell / length of an occlusion step, for which opacities are given.
    transmittance_exponent: f32,
    // Alpha of equation 8.
    opacity: f32,
    // 1 / gamma.
    power: f32,
    // Intensity of the surface, as the texture gives it. 1 if larger intensities are inside, else -1.
    isovalue: f32,
    side: f32,
    // 1: each octant's visibility is kept, not their mean.
    keeps_octants: u32,
    // Lower bound of a length divided by its length if the axes were perpendicular.
    least_stretch: f32,
}

// One of the 8 points of a grid around a place: its index in a buffer, x fastest, and its weight in trilinear
// interpolation. Beyond the grid the nearest points count.
struct Corner {
    index: u32,
    weight: f32,
}

fn corner_of(place: vec3<f32>, size: vec3<u32>, corner: u32) -> Corner {
    let last = vec3<f32>(size - 1u);
    let inside = clamp(place, vec3(0.0), last);
    let base = floor(inside);
    let is_far = (vec3(corner) & vec3(1u, 2u, 4u)) != vec3(0u);
    let at = vec3<u32>(min(base + select(vec3(0.0), vec3(1.0), is_far), last));
    let share = select(1.0 - (inside - base), inside - base, is_far);
    return Corner((at.z * size.y + at.y) * size.x + at.x, share.x * share.y * share.z);
}

// Distance of a voxel that has none yet, mm.
const FAR: f32 = 1e18;

@group(1) @binding(8) var<uniform> sweeping: Sweeping;
