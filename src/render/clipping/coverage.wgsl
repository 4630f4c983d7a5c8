// Coverage of a voxel: the visible share of the box of [-1, 1]^3 voxels around it (step IV of the CAO paper, section
// 3.5). Also whether a carver removes the voxel.
//
// COVERAGE_POINTS is the published rule (algorithm 2): the centre and 8 corners. If they disagree, 32 more points
// follow, 41 in all. COVERAGE_LINES needs fewer depths and changes steadily. Along lines of sight of the clip camera,
// the depths give the visible share exactly. The lines are a rank-1 lattice that is fixed to the carver and moves with
// it. A line that leaves the voxel on one side fades out there, and fades in on the other side.

#define_import_path bevy_contextual_ao::coverage

#import bevy_contextual_ao::{
    bricks::CARVER_BITS,
    clip_test::{is_in_dilation, is_in_unit_square, is_visible, to_clip_map},
    clip_pass::{COVERAGE_CENTER, COVERAGE_LINES, clip_pass},
    volume_bindings::{Carver, MAX_CARVERS, OPERATION_NONE, OPERATION_SUBTRACT, carvers, depth_maps, volume},
}

// Published points: half extent of the box of the first 9 points, voxels, and number of further points.
const FIRST_POINTS: f32 = 1.025;
const MORE_POINTS: u32 = 32u;

// Lines fade over this half width, voxels. It is small: a wide fade blurs the voxel's edge.
const FADE: f32 = 0.1;
// Half extent across the lines, voxels: sqrt(1 - FADE²), which keeps the box's variance, + FADE.
const EXTENT: f32 = 1.0949874;
// The lattice: point k is (k, 12 k mod 29) / 29. Among numbers of points below the published 32, 29 has the most even
// projections over all directions.
const LINES: u32 = 29u;
const GENERATOR: u32 = 12u;
// The first 9 lines are longer than the voxel by this factor, so that they miss little.
const FIRST_LINES: f32 = 1.5;

struct Clipping {
    coverage: f32,
    // A carver removes every point that can read the voxel.
    is_removed: bool,
}

// Clipping of a voxel by all carvers near it (bits). Only voxels that are not transparent need the coverage.
fn clip_voxel(voxel: vec3<f32>, near: u32, needs_coverage: bool) -> Clipping {
    let center_mm = local_position(voxel);
    var clipping = Clipping(1.0, false);
    var is_affected = false;
    var cuts = 0u;
    var rest = near;
    while rest != 0u {
        let first = firstTrailingBit(rest);
        rest &= rest - 1u;
        for (var i = first; i < MAX_CARVERS && carvers[i].operation != OPERATION_NONE; i += CARVER_BITS) {
            let p = to_clip_map(carvers[i], center_mm);
            let is_in = is_in_dilation(carvers[i], p);
            // An intersecting carver removes its outside.
            let subtracts = carvers[i].operation == OPERATION_SUBTRACT;
            let affects = select(!is_in.y, is_in.x, subtracts);
            let is_removed = select(!is_in.x, is_in.y, subtracts);
            is_affected |= affects;
            clipping.is_removed |= is_removed;
            if needs_coverage && clip_pass.coverage == COVERAGE_LINES && affects && !is_removed {
                let inside = inside_share(carvers[i], p);
                let visible = select(inside, 1.0 - inside, subtracts);
                cuts += u32(visible > 0.0 && visible < 1.0);
                clipping.coverage = min(clipping.coverage, visible);
            }
        }
    }
    if clipping.is_removed {
        clipping.coverage = 0.0;
    } else if clip_pass.coverage == COVERAGE_CENTER {
        clipping.coverage = f32(is_visible(center_mm, near));
    } else if needs_coverage && is_affected && (clip_pass.coverage != COVERAGE_LINES || cuts > 1u) {
        // The share that two carvers remove together does not follow from the share of each.
        clipping.coverage = visible_share(voxel, near);
    }
    return clipping;
}

fn local_position(voxel: vec3<f32>) -> vec3<f32> {
    return (volume.local_from_voxel * vec4(voxel, 1.0)).xyz;
}

// The published rule.
fn visible_share(voxel: vec3<f32>, near: u32) -> f32 {
    var visible = u32(is_visible(local_position(voxel), near));
    for (var corner = 0u; corner < 8u; corner += 1u) {
        let sign = vec3<f32>(vec3(corner & 1u, (corner >> 1u) & 1u, corner >> 2u)) * 2.0 - 1.0;
        visible += u32(is_visible(local_position(voxel + sign * FIRST_POINTS), near));
    }
    if visible == 0u || visible == 9u {
        return f32(visible) / 9.0;
    }
    for (var k = 0u; k < MORE_POINTS; k += 1u) {
        visible += u32(is_visible(local_position(voxel + spread_point(k)), near));
    }
    return f32(visible) / f32(9u + MORE_POINTS);
}

// Point k of the R3 low-discrepancy sequence (Roberts 2018), in [-1, 1]^3.
fn spread_point(k: u32) -> vec3<f32> {
    let step = vec3(0.8191725133961645, 0.6710436067037893, 0.5497004779019703);
    return 2.0 * fract(vec3(0.5) + f32(k + 1u) * step) - 1.0;
}

// Length of the part of a line of sight that is inside a carver's mesh, and length of the line. The line reaches
// `half_length` to either side of `p`. Both lengths are rounded alike, so that they are equal for a line that is all
// inside.
fn length_inside(carver: Carver, p: vec3<f32>, half_length: f32) -> vec2<f32> {
    let begin = p.z - half_length;
    let end = p.z + half_length;
    if !is_in_unit_square(p.xy) {
        return vec2(0.0, end - begin);
    }
    let texel = vec2<u32>(p.xy * volume.depth_map_size);
    var inside = 0.0;
    for (var layer = carver.first_layer; layer < carver.end_layer; layer += 1u) {
        let depths = textureLoad(depth_maps, texel, layer, 0);
        inside += max(0.0, min(depths.g, end) - max(depths.r, begin));
    }
    return vec2(inside, end - begin);
}

// Share of a voxel at `p` (clip map space) that is inside a carver's mesh. The voxel is taken as a box of the same
// variance that has one edge along the line of sight (`CarverUniform`).
fn inside_share(carver: Carver, p: vec3<f32>) -> f32 {
    // Lines in the voxel's middle, its corners and the middles of its sides. Most voxels are all in or all out.
    let first_half = FIRST_LINES * carver.footprint_z;
    var some_in = false;
    var some_out = false;
    for (var k = 0u; k < 9u; k += 1u) {
        // The middle comes first.
        let place = (k + 4u) % 9u;
        let offset = (vec2<f32>(vec2(place % 3u, place / 3u)) - 1.0) * EXTENT;
        let inside = length_inside(carver, beside(carver, p, offset), first_half);
        some_in |= inside.x > 0.0;
        some_out |= inside.x < inside.y;
        if some_in && some_out {
            break;
        }
    }
    if !(some_in && some_out) {
        return f32(some_in);
    }
    // The voxel's place in the carver's lattice.
    let x = p.x / carver.footprint_x.x;
    let place = vec2(x, (p.y - carver.footprint_x.y * x) / carver.footprint_y.x) / (2.0 * EXTENT);
    let half = carver.footprint_z;
    var inside = vec2(0.0);
    for (var k = 0u; k < LINES; k += 1u) {
        let point = (vec2<f32>(vec2(k, (GENERATOR * k) % LINES)) + 0.5) / f32(LINES);
        let offset = (fract(point - place + 0.5) - 0.5) * (2.0 * EXTENT);
        let fades = saturate((EXTENT - abs(offset)) / (2.0 * FADE));
        inside += fades.x * fades.y * length_inside(carver, beside(carver, p, offset), half);
    }
    return saturate(inside.x / inside.y);
}

// A point beside `p` (clip map space) by an offset in voxels across the line of sight.
fn beside(carver: Carver, p: vec3<f32>, offset: vec2<f32>) -> vec3<f32> {
    return p + offset.x * carver.footprint_x + offset.y * vec3(0.0, carver.footprint_y);
}
