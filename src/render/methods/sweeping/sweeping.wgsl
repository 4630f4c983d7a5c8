// What the passes of occlusion sweeping read of its settings (Singh, Yuksel, House: Fast Occlusion Sweeping,
// 2009). The Rust side is `resources.rs`.

#define_import_path bevy_contextual_ao::sweeping

struct Sweeping {
    // Of octants 0 to 3 and 4 to 7, with a mean of 1: bit a of an octant's number is set where its directions
    // go to larger indices along axis a.
    weights: array<vec4<f32>, 2>,
    // Distances between voxels, mm.
    spacing_mm: vec3<f32>,
    smallest_spacing_mm: f32,
    // Length of a voxel / length of an occlusion step, of which opacities are.
    transmittance_exponent: f32,
    // Alpha of equation 8.
    opacity: f32,
    // 1 / gamma.
    power: f32,
    // Intensity of the surface, as the texture gives it; 1 where larger ones are inside, else -1.
    isovalue: f32,
    side: f32,
    // 1: what every octant sees is kept, not their mean.
    keeps_octants: u32,
    // A lower bound of lengths over those that they had if the axes were perpendicular.
    least_stretch: f32,
}

// Of a voxel without a distance yet, mm.
const FAR: f32 = 1e18;

@group(1) @binding(8) var<uniform> sweeping: Sweeping;
