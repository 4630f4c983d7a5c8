//! Light on cuts: the orientation of a cut is that of the carver's surface.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{prelude::*, volume::WORLD_UNITS_PER_MM};
use contextual_ao_kit::{mode::ShadingMode, shapes::Triangles};

use crate::{
    integral::{View, srgb_byte},
    scene::{IMAGE, TestScene, volume_from},
    shading::blinn_phong,
    views::scene_of,
};

/// Half of the carver's edges, mm.
const HALF: DVec3 = DVec3::new(7.0, 5.0, 6.0);
/// Voxels along each side of the block, mm.
const BLOCK: u32 = 32;
const COLOR: f32 = 0.5;

/// A block of noise that is opaque all over, as if in the middle of tissue.
fn block() -> TestScene {
    let noise = |p: DVec3| 0.75 + 0.2 * (37.0 * p.x).sin() * (41.0 * p.y).sin() * (43.0 * p.z).sin();
    let function = TransferFunction::ramp(20.0, 60.0, 1.0, [COLOR; 3]).expect("a valid ramp");
    scene_of(volume_from(UVec3::splat(BLOCK), DVec3::ONE, noise), function, ShadingMode::Phong)
}

/// Interval of a ray in a box around the origin, with the normals of the faces at both ends.
fn in_box(origin: DVec3, direction: DVec3, half: DVec3) -> Option<[(f64, DVec3); 2]> {
    let (a, b) = ((-half - origin) / direction, (half - origin) / direction);
    let (near, far) = (a.min(b), a.max(b));
    let (begin, end) = (near.max_element(), far.min_element());
    let face =
        |planes: DVec3, at: f64| DVec3::select(planes.cmpeq(DVec3::splat(at)), DVec3::ONE, DVec3::ZERO);
    (begin < end).then(|| [(begin, face(near, begin)), (end, face(far, end))])
}

/// Checks the light on the cut that a box makes, and how many pixels show it.
fn check(name: &str, clip_mesh: ClipMesh, pose: Transform) {
    let keeps = clip_mesh.operation == ClipOperation::Intersect;
    let mut scene = block();
    scene.carve(Triangles::cuboid((2.0 * HALF).as_vec3()).mesh(), clip_mesh, pose);
    scene.settle();
    let camera = scene.camera();
    let view = View::of(&mut scene, camera, IMAGE);
    let image = scene.headless.image();
    let from_world = pose.to_matrix().as_dmat4().inverse();
    let color = f64::from(LinearRgba::from(Srgba::rgb(COLOR, COLOR, COLOR)).red);
    let (mut differences, mut faces) = (Vec::new(), DVec3::ZERO);
    for index in 0..IMAGE.element_product() {
        let pixel = UVec2::new(index % IMAGE.x, index / IMAGE.x);
        let (origin, direction) = view.ray(pixel.as_dvec2() + 0.5);
        let origin = origin / f64::from(WORLD_UNITS_PER_MM);
        let (p, d) = (from_world.transform_point3(origin), from_world.transform_vector3(direction));
        let Some([entry, exit]) = in_box(p, d, HALF) else { continue };
        let (along, normal) = if keeps { entry } else { exit };
        let Some([block, _]) = in_box(origin, direction, DVec3::splat(0.5 * f64::from(BLOCK))) else {
            continue;
        };
        // A cut is seen where the block begins inside of what is cut away.
        let is_open = if keeps { block.0 < entry.0 } else { entry.0 < block.0 && block.0 < exit.0 };
        // Away from the edges of the block and of the box.
        let place = p + along * d;
        let is_in_block = (origin + along * direction).abs().max_element() < 0.5 * f64::from(BLOCK) - 2.0;
        let from_edges = (HALF - place.abs()).to_array();
        let is_on_face = from_edges.iter().filter(|distance| **distance < 1.0).count() == 1;
        if is_open && is_in_block && is_on_face {
            let expected = srgb_byte(blinn_phong(DVec3::splat(color), normal.dot(d).abs(), 1.0).x);
            differences.push((f64::from(image[4 * index as usize]) - expected).abs());
            faces += normal;
        }
    }
    let most = differences.iter().copied().fold(0.0, f64::max);
    assert!(differences.len() > 200, "{name}: {} pixels show the cut", differences.len());
    assert!(faces.cmpgt(DVec3::splat(20.0)).all(), "{name}: faces are seen by {faces} pixels");
    // Half a byte of rounding, and depths of 32 bits.
    assert!(most < 1.0, "{name}: off by {most} bytes");
}

#[test]
fn a_cut_is_lit_as_the_carvers_own_surface() {
    let turn = Quat::from_euler(EulerRot::XYZ, 0.3, -0.4, 0.2);
    // Its sides are walls along the clip camera's line of sight.
    let pose = Transform::from_xyz(1.0, 1.0, 14.0).with_rotation(turn);
    check("cut", ClipMesh::default(), pose);
    check("kept", ClipMesh::intersect(), Transform::from_xyz(1.0, -2.0, 1.0).with_rotation(turn));
}

#[test]
fn a_rim_is_as_bright_as_the_surfaces_that_meet_there() {
    // A ridge: one side is the surface of the matter, as a scanner sees it, the other one a cut.
    let [face, cut] = [-1.0, 1.0].map(|side| DVec3::new(side, 0.0, 1.0).normalize());
    let half = 0.5 * f64::from(BLOCK);
    let matter = volume_from(UVec3::splat(BLOCK), DVec3::ONE, |p| {
        // The grid lies in patient space.
        let place = half * DVec3::new(-p.x, p.z, p.y);
        1.0 / (1.0 + (1.702 * (place.dot(face) - 4.0) / 0.9).exp())
    });
    let function = TransferFunction::ramp(76.0, 179.0, 1.0, [COLOR; 3]).expect("a valid ramp");
    let mut scene = scene_of(matter, function, ShadingMode::Phong);
    let volume = scene.volume;
    scene.world().entity_mut(volume).insert(VolumeShading { jitter: false, ..default() });
    scene.headless.set_mode(volume, ShadingMode::Phong);
    let pose = Transform::from_translation((24.0 * cut).as_vec3())
        .with_rotation(Quat::from_rotation_arc(Vec3::Z, cut.as_vec3()));
    scene.carve(Cuboid::new(40.0, 60.0, 40.0), ClipMesh::default(), pose);
    scene.settle();
    let camera = scene.camera();
    let view = View::of(&mut scene, camera, IMAGE);
    let image = scene.headless.image();
    let color = f64::from(LinearRgba::from(Srgba::rgb(COLOR, COLOR, COLOR)).red);
    let mut seen = [0, 0];
    for index in 0..IMAGE.element_product() {
        let pixel = UVec2::new(index % IMAGE.x, index / IMAGE.x);
        let (origin, direction) = view.ray(pixel.as_dvec2() + 0.5);
        // Where the ray meets the level of the ridge.
        let place = origin / f64::from(WORLD_UNITS_PER_MM);
        let place = place + direction * ((4.0 * 2f64.sqrt() - place.z) / direction.z);
        if place.truncate().abs().max_element() > 6.0 {
            continue;
        }
        let levels = [face, cut]
            .map(|normal| srgb_byte(blinn_phong(DVec3::splat(color), normal.dot(direction).abs(), 1.0).x));
        let [low, high] = [levels[0].min(levels[1]), levels[0].max(levels[1])];
        let shown = f64::from(image[4 * index as usize]);
        assert!(shown > low - 2.0 && shown < high + 2.0, "{place}: {shown} is not from {low} to {high}");
        seen[usize::from(place.x > 0.0)] += 1;
    }
    assert!(seen[0] > 100 && seen[1] > 100, "pixels on both sides: {seen:?}");
}
