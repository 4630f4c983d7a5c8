// Orientation of surfaces, for shading. It is the gradient of the reconstructed intensity, turned towards higher
// opacity. Near cuts and the grid's faces, their own orientation is blended in (Weiskopf, Engel and Ertl 2003): that of a
// cut is the carver's surface. Where only an isosurface is drawn, it is the gradient of the distance field
// (`sweeping/surface.wgsl`). The binding follows those of `volume_bindings` and `brick_bindings`.

#define_import_path bevy_contextual_ao::orientation

#import bevy_contextual_ao::{
    brick_bindings::carvers_near,
    classification::classify,
    cut_surface::away_from_cut,
    gradients::gradient_length,
    reconstruction::{intensity_gradient, trilinear_around, trilinear_at_place},
    volume_bindings::{edge_sampler, volume},
}

// A cut in front of a point, by a carver or by a face of the grid: its place on the ray, and its distance in voxels.
struct Cut {
    place: vec3<f32>,
    distance: f32,
}

const NO_CUT: Cut = Cut(vec3(0.0), 1e9);

// Direction into what is seen, volume space, of length 1 or 0, and how much of a surface there is: 1, or 0 where opacity
// does not change.
struct Surface {
    inward: vec3<f32>,
    strength: f32,
}

const NO_SURFACE: Surface = Surface(vec3(0.0), 0.0);

// Surfaces at a point: that of the matter there, and that of a cut in front of it. Strengths add up to at most 1.
struct Orientation {
    own: Surface,
    cut: Surface,
}

// Unit vector of a direction; 0 if there is none.
fn unit(direction: vec3<f32>) -> vec3<f32> {
    let size = length(direction);
    return select(vec3(0.0), direction / size, size > 1e-6);
}

// Direction into the grid through the face that a point lies on; 0 if the point lies on no face.
fn inward_from_face(p: vec3<f32>) -> vec3<f32> {
    let beyond = (abs(p - 0.5) - 0.5) * vec3<f32>(volume.dimensions);
    let nearest = max(beyond.x, max(beyond.y, beyond.z));
    let is_face = beyond == vec3(nearest) & vec3(nearest >= -0.1);
    let face = select(vec3(0.0), -sign(p - 0.5), is_face);
    return (transpose(volume.texture_from_local) * vec4(face, 0.0)).xyz;
}

#ifdef ISOSURFACE
@group(#{VOLUME_BIND_GROUP}) @binding(9) var surface: texture_3d<f32>;

// Signed distance of a point from the surface, mm; in a sheared grid a lower bound.
fn distance_from_surface(p: vec3<f32>) -> f32 {
    return textureSampleLevel(surface, edge_sampler, p, 0.0).w;
}

fn orientation_at(p: vec3<f32>, cut: Cut) -> Orientation {
    // A solid cut by the end of the grid faces out of the grid there, wherever the nearest surface is.
    let face = inward_from_face(p);
    let outward = textureSampleLevel(surface, edge_sampler, p, 0.0).xyz;
    let inward = unit(select(-outward, face, dot(face, face) > 0.0));
    return Orientation(Surface(inward, 1.0), NO_SURFACE);
}
#else
@group(#{VOLUME_BIND_GROUP}) @binding(9) var opacities: texture_3d<f32>;

// Direction towards higher opacity, volume space, longer where the opacity is steeper: 3D Sobel over 26 neighbours.
fn inward_by_opacities(p: vec3<f32>) -> vec3<f32> {
    let texel = 1.0 / vec3<f32>(volume.dimensions);
    var gradient = vec3(0.0);
    for (var k = 0; k < 27; k += 1) {
        let offset = vec3<f32>(vec3(k % 3, (k / 3) % 3, k / 9) - 1);
        let weight = vec3(2.0) - abs(offset);
        let opacity = textureSampleLevel(opacities, edge_sampler, p + offset * texel, 0.0).r;
        gradient += opacity * offset * vec3(weight.y * weight.z, weight.x * weight.z, weight.x * weight.y);
    }
    // Per voxel → per texture coordinate → per mm.
    let per_texture = gradient * vec3<f32>(volume.dimensions);
    return (transpose(volume.texture_from_local) * vec4(per_texture, 0.0)).xyz;
}

// Change of opacity over a voxel, as a share of the opacity, from which on there is a whole surface.
const SURFACE_CHANGE: f32 = 0.05;

// Surface by the intensities alone.
//
// A surface is often seen in the foot of an edge, where the gradient is small and follows the voxels. Its direction is
// therefore taken where the edge is steepest, up to a voxel from there along the gradient. In front of a thin wall that
// place is in front of the wall's middle.
fn orientation_by_intensities(p: vec3<f32>) -> Surface {
    let texel = 1.0 / vec3<f32>(volume.dimensions);
    // A rough gradient, per voxel.
    let around = trilinear_around(p);
    let slope = 0.5 * (around.behind - around.before);
    let along = unit(slope) * texel;
    let before = trilinear_at_place(p - along);
    let here = trilinear_at_place(p);
    let behind = trilinear_at_place(p + along);
    // Exact for an edge that is a normal distribution of 0.9 voxels.
    let to_steepest = 2.0 * (before + behind - 2.0 * here) / max(behind - before, 1e-9);
    let gradient = intensity_gradient(p + clamp(to_steepest, -1.0, 1.0) * along);
    let inward = unit((transpose(volume.texture_from_local) * vec4(gradient, 0.0)).xyz);
    let steepness = gradient_length(slope);
    let opacity = vec3(classify(before, steepness).a, classify(here, steepness).a, classify(behind, steepness).a);
    let change = max(abs(opacity.x - opacity.y), abs(opacity.z - opacity.y));
    let most = max(opacity.x, max(opacity.y, opacity.z));
    let strength = saturate(change / max(SURFACE_CHANGE * most, 1e-9));
    return Surface(select(1.0, -1.0, opacity.z < opacity.x) * inward, strength);
}

// Direction into what is seen at a point on a cut, volume space, of any length.
fn inward_from_cut(p: vec3<f32>) -> vec3<f32> {
    let face = inward_from_face(p);
    if dot(face, face) > 0.0 {
        return face;
    }
    let voxel = p * vec3<f32>(volume.dimensions);
    let position_mm = (volume.local_from_voxel * vec4(voxel - 0.5, 1.0)).xyz;
    let away = away_from_cut(position_mm, carvers_near(voxel));
    if dot(away, away) > 0.0 {
        return away;
    }
    return inward_by_opacities(p);
}

// A cut's own orientation fades behind the cut: over this many voxels, and more slowly where there is no other surface.
const CUT_FADES: f32 = 1.0;
const CUT_FADES_INSIDE: f32 = 4.0;

// The orientation at a point.
fn orientation_at(p: vec3<f32>, cut: Cut) -> Orientation {
    let own = orientation_by_intensities(p);
    if cut.distance >= CUT_FADES_INSIDE {
        return Orientation(own, NO_SURFACE);
    }
    let inside = (1.0 - own.strength) * (1.0 - cut.distance / CUT_FADES_INSIDE);
    let share = max(1.0 - cut.distance / CUT_FADES, inside);
    let rest = Surface(own.inward, (1.0 - share) * own.strength);
    return Orientation(rest, Surface(unit(inward_from_cut(cut.place)), share));
}
#endif

// One direction for all surfaces at a point; 0 if there is none.
fn mean_inward(orientation: Orientation) -> vec3<f32> {
    return orientation.own.strength * orientation.own.inward + orientation.cut.strength * orientation.cut.inward;
}
