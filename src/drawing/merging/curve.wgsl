// Transmittance along a pixel's ray through a volume, as a curve: straight between nodes, as in deep shadow maps (Lokovic and
// Veach 2000, section 3.3). The abscissa is the depth: the distance from the plane through the camera, world units.

#define_import_path bevy_contextual_ao::curve

// Most nodes of a curve. The more, the closer are rays with many layers; each pixel takes 4 bytes more.
const NODES: u32 = 14u;
// Words of a curve: the depth at which its ray begins, the depth of a unit, the nodes.
const CURVE_WORDS: u32 = 16u;
// Depths of nodes, and transmittances, are whole numbers of units up to this one.
const UNITS: f32 = 65535.0;

fn pack_node(place: f32, transmittance: f32) -> u32 {
    return u32(place) | (u32(transmittance * UNITS + 0.5) << 16u);
}

// A node's place in units behind the ray's begin, and the transmittance up to there.
fn unpack_node(word: u32) -> vec2<f32> {
    return vec2(f32(word & 0xffffu), f32(word >> 16u) / UNITS);
}
