// Ambient occlusion from the visibility of each octant of directions (Singh, Yuksel, House: Fast Occlusion Sweeping,
// 2009, equations 3 to 5): the sum of V_s G_s(N) over the octants, for the normal of a point. G_s is the cosine
// integrated over an octant. Its table is behind that of the transfer function (`geometry_term.rs`). Normals are on an
// octahedron unfolded to a square. Octants 0 to 3 are in row 1, octants 4 to 7 in row 2.

#define_import_path bevy_contextual_ao::octants

#import bevy_contextual_ao::volume_bindings::{lookup_table, volume}

const PI: f32 = 3.14159265;
// Number of normals along each side of the table.
const SIDE: u32 = 63u;

// Values of octants 0 to 3, and of octants 4 to 7.
struct Octants {
    low: vec4<f32>,
    high: vec4<f32>,
}

// Place of a point's octants in the occlusion texture (texture coordinates): 0 to 3 in the nearer half, 4 to 7 in
// the farther half. Filtering must not mix the halves.
fn low_octants_at(p: vec3<f32>) -> vec3<f32> {
    let margin = 0.5 / f32(volume.dimensions.z);
    return vec3(p.xy, 0.5 * clamp(p.z, margin, 1.0 - margin));
}

fn high_octants_at(p: vec3<f32>) -> vec3<f32> {
    return low_octants_at(p) + vec3(0.0, 0.0, 0.5);
}

// Share of the light that reaches a point. `inward` points into the surface, volume space.
fn octants_factor(visible: Octants, inward: vec3<f32>) -> f32 {
    let terms = geometry_terms(-(inward * volume.octant_axes));
    let low = terms.low + volume.both_sides * terms.high.wzyx;
    let high = terms.high + volume.both_sides * terms.low.wzyx;
    let lit = dot(volume.low_octants * visible.low, low) + dot(volume.high_octants * visible.high, high);
    // Over all directions the cosine's integral is pi on one side, and 2 pi on both.
    let share = saturate(lit / (PI + PI * volume.both_sides));
    return select(0.0, pow(share, volume.occlusion_power), share > 0.0);
}

// G_s of a normal of any length. Without a normal it is the mean over all normals.
fn geometry_terms(normal: vec3<f32>) -> Octants {
    let size = dot(abs(normal), vec3(1.0));
    if size < 1e-6 {
        return Octants(vec4(PI / 8.0), vec4(PI / 8.0));
    }
    let n = normal / size;
    let folded = (1.0 - abs(n.yx)) * select(vec2(-1.0), vec2(1.0), n.xy >= vec2(0.0));
    let place = select(n.xy, folded, n.z < 0.0) * 0.5 + 0.5;
    let at = saturate(place) * f32(SIDE - 1u);
    let cell = min(vec2<u32>(at), vec2(SIDE - 2u));
    let share = at - vec2<f32>(cell);
    let first = cell.y * SIDE + cell.x;
    return Octants(table_at(0u, first, share), table_at(1u, first, share));
}

// Interpolates between the four normals around a place.
fn table_at(row: u32, first: u32, share: vec2<f32>) -> vec4<f32> {
    let a = textureLoad(lookup_table, vec2(first, row), 0);
    let b = textureLoad(lookup_table, vec2(first + 1u, row), 0);
    let c = textureLoad(lookup_table, vec2(first + SIDE, row), 0);
    let d = textureLoad(lookup_table, vec2(first + SIDE + 1u, row), 0);
    return mix(mix(a, b, share.x), mix(c, d, share.x), share.y);
}
