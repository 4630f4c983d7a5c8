// Orientation of surfaces, for shading. It is the gradient of the reconstructed intensity, turned towards higher
// opacity. Near cuts and the grid's faces, their own orientation is blended in (Weiskopf, Engel and Ertl 2003): that of a
// cut is the carver's surface. Where only an isosurface is drawn, it is the gradient of the distance
// field (`sweeping/surface.wgsl`). The binding follows those of `volume_bindings` and `brick_bindings`.

#define_import_path bevy_contextual_ao::orientation

#import bevy_contextual_ao::{
    brick_bindings::carvers_near,
    cut_surface::away_from_cut,
    reconstruction::{intensity_gradient, trilinear_at_place},
    volume_bindings::{edge_sampler, opacity_of_intensity, volume},
}

// A cut in front of a point, by a carver or by a face of the grid: its place on the ray, and the share of its
// orientation, 1 at the cut and 0 from a voxel behind it on.
struct Cut {
    place: vec3<f32>,
    share: f32,
}

const NO_CUT: Cut = Cut(vec3(0.0), 0.0);

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

// Direction into the surface, volume space, of any length.
fn inward(p: vec3<f32>, cut: Cut) -> vec3<f32> {
    // A solid cut by the end of the grid faces out of the grid there, wherever the nearest surface is.
    let face = inward_from_face(p);
    return select(-textureSampleLevel(surface, edge_sampler, p, 0.0).xyz, face, dot(face, face) > 0.0);
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

// Unit vector of a direction; 0 if there is none.
fn unit(direction: vec3<f32>) -> vec3<f32> {
    let size = length(direction);
    return select(vec3(0.0), direction / size, size > 1e-6);
}

// Direction towards higher opacity by the intensities alone, volume space, of length 1 or 0.
//
// A surface is often seen in the foot of an edge, where the gradient is small and follows the voxels. Its direction is
// therefore taken where the edge is steepest, up to a voxel from there along the gradient. In front of a thin wall that
// place is in front of the wall's middle.
fn inward_by_intensities(p: vec3<f32>) -> vec3<f32> {
    let texel = 1.0 / vec3<f32>(volume.dimensions);
    let x = vec3(texel.x, 0.0, 0.0);
    let y = vec3(0.0, texel.y, 0.0);
    let z = vec3(0.0, 0.0, texel.z);
    // A rough gradient, per voxel.
    let slope = 0.5 * vec3(
        trilinear_at_place(p + x) - trilinear_at_place(p - x),
        trilinear_at_place(p + y) - trilinear_at_place(p - y),
        trilinear_at_place(p + z) - trilinear_at_place(p - z),
    );
    let change = length(slope);
    let along = unit(slope) * texel;
    let intensity = trilinear_at_place(p);
    let rise = trilinear_at_place(p + along) - intensity;
    let rise_before = intensity - trilinear_at_place(p - along);
    // Exact for an edge that is a normal distribution of 0.9 voxels.
    let to_steepest = 2.0 * (rise - rise_before) / max(rise + rise_before, 1e-9);
    let gradient = intensity_gradient(p + clamp(to_steepest, -1.0, 1.0) * along);
    // Over a voxel, opacity rises or falls.
    let falls = opacity_of_intensity(intensity + change) < opacity_of_intensity(intensity - change);
    let inward = unit((transpose(volume.texture_from_local) * vec4(gradient, 0.0)).xyz);
    return select(1.0, -1.0, falls) * inward;
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

// Direction into what is seen at a point, volume space, of length 1 or less.
fn inward(p: vec3<f32>, cut: Cut) -> vec3<f32> {
    var direction = vec3(0.0);
    if cut.share < 1.0 {
        direction = (1.0 - cut.share) * inward_by_intensities(p);
    }
    if cut.share > 0.0 {
        direction += cut.share * unit(inward_from_cut(cut.place));
    }
    return direction;
}
#endif
