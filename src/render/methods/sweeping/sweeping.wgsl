// Settings that the passes of occlusion sweeping read (Singh, Yuksel, House: Fast Occlusion Sweeping, 2009). The Rust
// side is `resources.rs`.

#define_import_path bevy_contextual_ao::sweeping

struct Sweeping {
    // Weights of octants 0 to 3 and of octants 4 to 7, with a mean of 1. Bit a of an octant's number is set where
    // its directions go to larger indices along axis a.
    weights: array<vec4<f32>, 2>,
    // Distances between voxels, mm.
    spacing_mm: vec3<f32>,
    smallest_spacing_mm: f32,
    // Length of a voxel / length of an occlusion step, for which opacities are given.
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

// Distance of a voxel that has none yet, mm.
const FAR: f32 = 1e18;

@group(1) @binding(8) var<uniform> sweeping: Sweeping;
