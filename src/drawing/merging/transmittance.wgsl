// Transmittance of a volume along the rays of pixels, for volumes that share its space (`merged`). Each curve keeps to the
// transmittances at all ends of slices, as close as its nodes allow: the tolerance is doubled until they suffice.
//
// Nodes are found in one go along the ray (Lokovic and Veach 2000, section 3.3): from the last node, all lines that miss no
// point behind it by more than the tolerance form a cone. Once a point lies outside, the point before becomes a node.
//
// A pixel at an outline (`outlines.wgsl`) has the mean of the curves of its rays: OUTLINE_RAYS finds these.

#import bevy_contextual_ao::{
    curve::{CurvesOf, NODES, UNITS, has_curve, pack_node, word_of_curve},
    marched_view::{
        MarchedView, OUTLINE_HEAD, outline_offset, outline_ray, outline_rays, ray_through, unpack_pixel,
    },
    view_ray::{OPAQUE, ViewRay, depth_at},
    window::pixel_of_lane,
    work_list::ROW,
}
#ifdef ISOSURFACE
#import bevy_contextual_ao::surface_ray::surface_hit
#else
#ifdef MODULATED
#import bevy_contextual_ao::ambient_light::opacity_share_at
#endif
#import bevy_contextual_ao::{
    lit_slices::{end_at, middle_of, seen_slice},
    next_run::{march_behind, next_run},
    runs::{Run, THEN_END, THEN_RUN, slice_of_run, slices_of, unpack_run},
    seen::{first_run, run_at, runs},
}
#endif

@group(#{VOLUME_BIND_GROUP}) @binding(12) var<uniform> marched_view: MarchedView;
@group(1) @binding(0) var<storage, read_write> merged: array<u32>;
// First and end pixel with a curve, and the word of the first curve.
@group(1) @binding(1) var<storage, read> curves: array<u32, 3>;
// Lists of the pixels at outlines.
@group(1) @binding(2) var<storage, read> outlines: array<u32>;

// The first tolerance: a quarter of a level of an 8-bit image.
const TOLERANCE: f32 = 1.0 / 1024.0;

// A curve that is being found. Points are places in units, and transmittances.
struct Curve {
    tolerance: f32,
    count: u32,
    // The last node, and the last point.
    node: vec2<f32>,
    point: vec2<f32>,
    // Bounds of slopes.
    low: f32,
    high: f32,
}

var<private> nodes: array<vec2<f32>, NODES>;

fn add_node(curve: ptr<function, Curve>, point: vec2<f32>) {
    if (*curve).count < NODES {
        nodes[(*curve).count] = point;
    }
    (*curve).count += 1u;
    (*curve).node = point;
    (*curve).low = -1e30;
    (*curve).high = 1e30;
}

// Adds a point behind the others.
fn add_point(curve: ptr<function, Curve>, point: vec2<f32>) {
    if (*curve).count == 0u {
        add_node(curve, point);
    }
    // Where a step has no length, the line is nearly upright.
    var way = max(point.x - (*curve).node.x, 1e-3);
    let slope = (point.y - (*curve).node.y) / way;
    if slope < (*curve).low || slope > (*curve).high {
        add_node(curve, (*curve).point);
        way = max(point.x - (*curve).node.x, 1e-3);
    }
    let rise = point.y - (*curve).node.y;
    (*curve).low = max((*curve).low, (rise - (*curve).tolerance) / way);
    (*curve).high = min((*curve).high, (rise + (*curve).tolerance) / way);
    (*curve).point = point;
}

// Depths of a ray's places.
struct Scale {
    begin_depth: f32,
    depth_per_unit: f32,
}

fn scale_of(ray: ViewRay) -> Scale {
    let begin_depth = depth_at(ray, ray.begin_mm);
    let depth = max(depth_at(ray, ray.end_mm) - begin_depth, 0.0);
    // The last slice may end a step behind the box.
    return Scale(begin_depth, max(depth, 1e-9) / (UNITS - 1.0));
}

fn place_of(ray: ViewRay, scale: Scale, along_mm: f32) -> f32 {
    return clamp(round((depth_at(ray, along_mm) - scale.begin_depth) / scale.depth_per_unit), 0.0, UNITS);
}

// Adds the points of a ray. Returns the opacity of the ray. `number` is that of a ray at an outline.
#ifdef ISOSURFACE
fn follow(ray: ViewRay, scale: Scale, number: u32, curve: ptr<function, Curve>) -> f32 {
    let hit = surface_hit(ray);
    if hit.alpha > 0.0 {
        let place = place_of(ray, scale, hit.along_mm);
        add_point(curve, vec2(place, 1.0));
        add_point(curve, vec2(place, 0.0));
    }
    return hit.alpha;
}
#else
fn follow(ray: ViewRay, scale: Scale, number: u32, curve: ptr<function, Curve>) -> f32 {
    var alpha = 0.0;
#ifdef OUTLINE_RAYS
    var run = run_at(marched_view, marched_view.first_run + number);
#else
    var run = first_run(marched_view, vec2<u32>(ray.place));
#endif
    while true {
        let slices = slices_of(run);
        var begin = end_at(ray, slice_of_run(ray, run, 0u).begin_mm);
        for (var k = 0u; k < slices && alpha < OPAQUE; k += 1u) {
            let slice = slice_of_run(ray, run, k);
            let end = end_at(ray, slice.end_mm);
            var share = 1.0;
#ifdef MODULATED
            share = opacity_share_at(middle_of(ray, slice));
#endif
            let seen = seen_slice(ray, slice, begin, end, alpha, share);
            begin = end;
            if k == 0u {
                add_point(curve, vec2(place_of(ray, scale, slice.begin_mm), 1.0 - alpha));
            }
            add_point(curve, vec2(place_of(ray, scale, seen.along_mm), 1.0 - alpha - 0.5 * seen.opacity));
            alpha += seen.opacity;
            add_point(curve, vec2(place_of(ray, scale, slice.end_mm), 1.0 - alpha));
        }
        if alpha >= OPAQUE || run.then == THEN_END {
            break;
        }
        if run.then == THEN_RUN {
            run = unpack_run(runs[run.next]);
        } else {
            var march = march_behind(ray, run, alpha);
            run = next_run(ray, &march, OPAQUE);
        }
    }
    return alpha;
}
#endif

fn empty_curve(tolerance: f32) -> Curve {
    return Curve(tolerance, 0u, vec2(0.0), vec2(0.0), 0.0, 0.0);
}

fn end_curve(curve: ptr<function, Curve>) {
    if (*curve).count > 0u {
        add_node(curve, (*curve).point);
    }
}

// Finds the nodes of a ray, and their number.
fn trace(ray: ViewRay, scale: Scale, number: u32) -> u32 {
    var curve: Curve;
    var opacity = 0.0;
    var tolerance = TOLERANCE;
    while true {
        curve = empty_curve(tolerance);
        opacity = follow(ray, scale, number, &curve);
        end_curve(&curve);
        if curve.count <= NODES {
            break;
        }
        tolerance *= 2.0;
    }
    // The little light that is left behind opaque matter gets its colour (`completed` in `compositing`).
    let scaled = 1.0 / select(1.0, opacity, opacity >= OPAQUE);
    for (var k = 0u; k < curve.count; k += 1u) {
        nodes[k].y = clamp(1.0 - scaled * (1.0 - nodes[k].y), 0.0, 1.0);
    }
    return curve.count;
}

fn wanted() -> CurvesOf {
    return CurvesOf(unpack_pixel(curves[0]), unpack_pixel(curves[1]), curves[2]);
}

fn write_curve(pixel: vec2<u32>, scale: Scale, count: u32) {
    let word = word_of_curve(wanted(), pixel);
    merged[word] = bitcast<u32>(scale.begin_depth);
    merged[word + 1u] = bitcast<u32>(scale.depth_per_unit);
    // Behind the last node nothing changes.
    var node = vec2(UNITS, 1.0);
    for (var k = 0u; k < NODES; k += 1u) {
        if k < count {
            node = nodes[k];
        }
        merged[word + 2u + k] = pack_node(select(UNITS, node.x, k < count), node.y);
    }
}

#ifdef OUTLINE_RAYS
const WIDTH: u32 = 64u;

// Nodes of each ray of the workgroup, as depths and transmittances, and their number.
var<workgroup> traced: array<vec2<f32>, WIDTH * NODES>;
var<workgroup> counts: array<u32, WIDTH>;

// Transmittance of a ray up to a depth, if so many of its nodes are in front.
fn traced_at(ray: u32, before: u32, depth: f32) -> f32 {
    let near = traced[ray * NODES + max(before, 1u) - 1u];
    let far = traced[ray * NODES + min(before, NODES - 1u)];
    let way = saturate((depth - near.x) / max(far.x - near.x, 1e-12));
    let value = select(mix(near.y, far.y, way), near.y, before == counts[ray]);
    return select(value, 1.0, before == 0u);
}

// A scale from the first to the last node of some rays.
fn scale_of_all(first: u32, rays: u32) -> Scale {
    var near = 1e30;
    var far = 0.0;
    for (var k = first; k < first + rays; k += 1u) {
        if counts[k] > 0u {
            near = min(near, traced[k * NODES].x);
            far = max(far, traced[k * NODES + counts[k] - 1u].x);
        }
    }
    return Scale(near, max(far - near, 1e-9) / UNITS);
}

// Adds the nodes of all rays, nearest first, each with the mean of the rays there.
fn follow_mean(first: u32, rays: u32, scale: Scale, curve: ptr<function, Curve>) {
    var passed: array<u32, WIDTH>;
    for (var k = 0u; k < rays; k += 1u) {
        passed[k] = 0u;
    }
    while true {
        var nearest = rays;
        var depth = 1e30;
        for (var k = 0u; k < rays; k += 1u) {
            let own = traced[(first + k) * NODES + min(passed[k], NODES - 1u)].x;
            let is_nearer = passed[k] < counts[first + k] && own < depth;
            nearest = select(nearest, k, is_nearer);
            depth = select(depth, own, is_nearer);
        }
        if nearest == rays {
            break;
        }
        passed[nearest] += 1u;
        var sum = 0.0;
        for (var k = 0u; k < rays; k += 1u) {
            sum += traced_at(first + k, passed[k], depth);
        }
        let place = clamp(round((depth - scale.begin_depth) / scale.depth_per_unit), 0.0, UNITS);
        add_point(curve, vec2(place, sum / f32(rays)));
    }
}

@compute @workgroup_size(WIDTH)
fn trace_curves(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let rays = outline_rays(marched_view);
    let first = marched_view.first_outline;
    let own = outline_ray(marched_view, outlines[first], group.y * ROW + group.x, WIDTH, lane);
    var pixel = vec2(0u);
    var is_traced = own.is_listed;
    if is_traced {
        pixel = unpack_pixel(outlines[first + OUTLINE_HEAD + own.slot]);
        is_traced = has_curve(wanted(), pixel);
    }
    if is_traced {
        let ray = ray_through(marched_view, vec2<f32>(pixel) + outline_offset(marched_view, own.number));
        let scale = scale_of(ray);
        let count = trace(ray, scale, rays * own.slot + own.number);
        counts[lane] = count;
        for (var k = 0u; k < count; k += 1u) {
            traced[lane * NODES + k] = vec2(scale.begin_depth + nodes[k].x * scale.depth_per_unit, nodes[k].y);
        }
    }
    workgroupBarrier();
    if is_traced && own.number == 0u {
        let scale = scale_of_all(lane, rays);
        var curve: Curve;
        var tolerance = TOLERANCE;
        while true {
            curve = empty_curve(tolerance);
            follow_mean(lane, rays, scale, &curve);
            end_curve(&curve);
            if curve.count <= NODES {
                break;
            }
            tolerance *= 2.0;
        }
        write_curve(pixel, scale, curve.count);
    }
}
#else
@compute @workgroup_size(64)
fn trace_curves(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let pixel = wanted().first + 8u * group.xy + pixel_of_lane(lane);
    if has_curve(wanted(), pixel) {
        let ray = ray_through(marched_view, vec2<f32>(pixel) + 0.5);
        let scale = scale_of(ray);
        write_curve(pixel, scale, trace(ray, scale, 0u));
    }
}
#endif
