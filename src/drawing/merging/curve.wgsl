// Transmittance along a pixel's ray through a volume, as a curve: straight between nodes, as in deep shadow maps (Lokovic and
// Veach 2000, section 3.3). The abscissa is the depth: the distance from the plane through the camera, world units.

#define_import_path bevy_contextual_ao::curve

// Most nodes of a curve. The more, the closer are rays with many layers; each pixel takes 4 bytes more.
const NODES: u32 = 14u;
// Words of a curve: the depth at which its ray begins, the depth of a unit, the nodes.
const CURVE_WORDS: u32 = 16u;
// Depths of nodes, and transmittances, are whole numbers of units up to this one.
const UNITS: f32 = 65535.0;

// Curves of a volume in a view: those of the pixels in which it may share space.
struct CurvesOf {
    first: vec2<u32>,
    end: vec2<u32>,
    // Word of the first pixel's curve.
    word: u32,
}

fn has_curve(curves: CurvesOf, pixel: vec2<u32>) -> bool {
    return all(pixel >= curves.first) && all(pixel < curves.end);
}

// First word of the curve of a pixel that has one.
fn word_of_curve(curves: CurvesOf, pixel: vec2<u32>) -> u32 {
    let place = pixel - curves.first;
    return curves.word + CURVE_WORDS * (place.y * (curves.end.x - curves.first.x) + place.x);
}

fn pack_node(place: f32, transmittance: f32) -> u32 {
    return u32(place) | (u32(transmittance * UNITS + 0.5) << 16u);
}

// A node's place in units behind the ray's begin, and the transmittance up to there.
fn unpack_node(word: u32) -> vec2<f32> {
    return vec2(f32(word & 0xffffu), f32(word >> 16u) / UNITS);
}
