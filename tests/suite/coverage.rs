//! Coverage by the rules that count points, against an exact count. An exact inside test of the carvers' meshes
//! judges the same points one by one.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{prelude::*, volume::VolumeGeometry};
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    headless::voxel_at,
    scene::{TestScene, few_rays, opaque_ramp, volume_from},
};
use contextual_ao_kit::{inside::InsideTest, shapes::Triangles};

const SIZE: UVec3 = UVec3::new(26, 24, 22);
/// Texels along each side of a depth map.
const MAP_SIZE: u32 = 512;
const SPACING: DVec3 = DVec3::new(1.0, 0.8, 1.3);

/// A carver's mesh, operation and pose (mm from the volume's centre).
type Carver = (Triangles, ClipMesh, Transform);

/// A carver's mesh, placed in the volume.
struct Shape {
    exact: InsideTest,
    keeps: bool,
    /// Distance from the surface, mm, below which the depth maps cannot tell: a depth is that of its texel's centre.
    texel_mm: f32,
}

impl Shape {
    fn new((mesh, clip_mesh, pose): &Carver) -> Self {
        let placed = mesh.clone().transformed(pose.compute_affine());
        let corners = || mesh.positions.iter().map(|&corner| Vec3::from(corner));
        let extent =
            corners().reduce(Vec3::max).unwrap_or_default() - corners().reduce(Vec3::min).unwrap_or_default();
        Self {
            exact: InsideTest::new(&placed),
            keeps: clip_mesh.operation == ClipOperation::Intersect,
            // Half a texel's diagonal, plus rounding. The texel includes the map's margin of two 512ths of the mesh
            // on either side.
            texel_mm: 0.72 * extent.max_element() / MAP_SIZE as f32,
        }
    }
}

/// Visibility of a point.
#[derive(Clone, Copy, PartialEq)]
enum Point {
    Visible,
    Clipped,
    /// Too near a surface to tell.
    Unsure,
}

fn look_at(shapes: &[Shape], p: Vec3) -> Point {
    if shapes.iter().any(|shape| shape.exact.distance(p) < shape.texel_mm) {
        return Point::Unsure;
    }
    let is_visible = shapes.iter().all(|shape| shape.exact.contains(p) == shape.keeps);
    if is_visible { Point::Visible } else { Point::Clipped }
}

/// First 9 points of the published rule (algorithm 2), in voxels from a voxel's centre: the centre and the corners.
fn first_points() -> Vec<DVec3> {
    let corners = (0..8).map(|k| DVec3::from_array([0, 1, 2].map(|axis| f64::from(2 * (k >> axis & 1) - 1))));
    [DVec3::ZERO].into_iter().chain(corners.map(|corner| 1.025 * corner)).collect()
}

/// The 32 further points: the low-discrepancy sequence of Roberts (2018) in [-1, 1]^3. Its steps are the first three
/// powers of 1 / g, with g^4 = g + 1.
fn more_points() -> Vec<DVec3> {
    let g = (0..60).fold(1.2f64, |g, _| (g + 1.0).powf(0.25));
    let step = DVec3::new(g.powi(-1), g.powi(-2), g.powi(-3));
    (1..=32).map(|k| 2.0 * (0.5 + f64::from(k) * step).fract() - 1.0).collect()
}

/// Least and most coverage that a rule may give a voxel. `None` if it is unknown which points count.
fn expected(rule: CoverageRule, look: impl Fn(DVec3) -> Point) -> Option<[f64; 2]> {
    let count = |points: &[DVec3]| {
        let seen: Vec<_> = points.iter().map(|offset| look(*offset)).collect();
        [Point::Visible, Point::Unsure].map(|kind| seen.iter().filter(|point| **point == kind).count() as f64)
    };
    let first = first_points();
    let [visible, unsure] = count(if rule == CoverageRule::Center { &first[..1] } else { &first });
    if unsure > 0.0 {
        return None;
    }
    if rule == CoverageRule::Center {
        return Some([visible; 2]);
    }
    if visible == 0.0 || visible == 9.0 {
        return Some([visible / 9.0; 2]);
    }
    let [more, unsure] = count(&more_points());
    Some([(visible + more) / 41.0, (visible + more + unsure) / 41.0])
}

/// Compares all voxels with the rule `counted_by`. If the scene has another rule, compares only voxels that two
/// surfaces cross.
fn check(name: &str, carvers: &[Carver], rule: CoverageRule, counted_by: CoverageRule) {
    // The whole volume is opaque, so a voxel's opacity is its coverage.
    let volume = volume_from(SIZE, SPACING, |_| 1.0);
    let geometry = VolumeGeometry::of(&volume);
    let mut scene = TestScene::new(volume, opaque_ramp(), few_rays(), ShadingMode::Cao);
    scene.set_clip(|clip| *clip = ClipSettings { coverage: rule, depth_map_size: MAP_SIZE, ..clip.clone() });
    for (mesh, clip_mesh, pose) in carvers {
        scene.carve(mesh.mesh(), clip_mesh.clone(), *pose);
    }
    scene.settle();
    let shapes: Vec<_> = carvers.iter().map(Shape::new).collect();
    // No point lies farther from its voxel's centre than this.
    let reach_mm = 1.03 * geometry.cell_diagonal_mm() as f32;
    let (mut partial, mut skipped, mut compared) = (0, 0, 0);
    for (index, opacity) in (0..).zip(scene.opacities()) {
        let voxel = voxel_at(index, SIZE).as_dvec3();
        let place = |offset| geometry.local_from_voxel.transform_point3(voxel + offset).as_vec3();
        let center = place(DVec3::ZERO);
        let distances = || shapes.iter().map(|shape| shape.exact.distance(center));
        if rule != counted_by && distances().filter(|distance| *distance < 0.6).count() < 2 {
            continue;
        }
        let range = if distances().all(|distance| distance > reach_mm) {
            let is_visible = look_at(&shapes, center) == Point::Visible;
            Some([f64::from(u8::from(is_visible)); 2])
        } else {
            expected(counted_by, |offset| look_at(&shapes, place(offset)))
        };
        let Some(range) = range else {
            skipped += 1;
            continue;
        };
        let [least, most] = range.map(|share| (255.0 * share).round() as u8);
        assert!((least..=most).contains(&opacity), "{name}, {voxel}: {opacity}, not {least} to {most}");
        compared += 1;
        // The coverage is known to one of 41 points.
        partial += usize::from((1..255).contains(&least) && most - least <= 7);
    }
    println!("{name}, {rule:?}: {compared} compared, {partial} of them cut, {skipped} skipped");
    let is_cut = counted_by != CoverageRule::Center;
    assert!(if is_cut { partial > 50 } else { compared > 1000 }, "{name}: {partial} voxels are cut");
    // A texel is a twentieth of a voxel. Beside two surfaces, more points are too near a surface to tell.
    let most_skipped = if rule == counted_by { compared / 10 } else { compared };
    assert!(skipped < most_skipped, "{name}: {skipped} of {compared} voxels cannot be told");
}

fn scenes() -> [(&'static str, Vec<Carver>); 5] {
    let at = Transform::from_xyz(3.1, 2.3, 4.2);
    let tilted = at.with_rotation(Quat::from_euler(EulerRot::XYZ, 0.5, -0.8, 1.1));
    let sphere = || (Triangles::sphere(6.7, 32), ClipMesh::default(), at);
    let cuboid = || (Triangles::cuboid(Vec3::new(9.3, 7.1, 11.7)), ClipMesh::default(), tilted);
    let torus = || (Triangles::torus(6.2, 2.6, 64, 32), ClipMesh::default(), tilted);
    let probe = || (Triangles::sphere(9.9, 32), ClipMesh::intersect(), Transform::from_xyz(1.3, -0.6, 0.9));
    let scaled = || {
        let (mesh, clip_mesh, pose) = cuboid();
        (mesh, clip_mesh, pose.with_scale(Vec3::new(-0.7, 1.3, 0.9)))
    };
    [
        ("sphere", vec![sphere()]),
        ("mirrored box", vec![scaled()]),
        ("torus", vec![torus()]),
        ("probe", vec![probe()]),
        ("sphere and box in a probe", vec![sphere(), cuboid(), probe()]),
    ]
}

#[test]
fn published_points_are_counted_as_defined() {
    for (name, carvers) in scenes() {
        check(name, &carvers, CoverageRule::Points, CoverageRule::Points);
    }
}

#[test]
fn the_centre_alone_decides_where_it_is_to() {
    for (name, carvers) in scenes() {
        check(name, &carvers, CoverageRule::Center, CoverageRule::Center);
    }
}

#[test]
fn what_several_carvers_cut_is_counted_by_the_published_points() {
    let [.., (name, carvers)] = scenes();
    check(name, &carvers, CoverageRule::Lines, CoverageRule::Points);
}
