//! Unusual carver poses: huge, tiny, not finite, outside, around everything, on the face, coincident. Also a camera
//! inside the hole.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{diagnostics::Work, prelude::*};
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    exact::assert_exact,
    needs,
    scene::{TestScene, count_different, few_rays, folded_volume, is_empty, opaque_ramp},
};

const SIZE: UVec3 = UVec3::new(26, 24, 22);
const PLACE: Vec3 = Vec3::new(5.0, 5.0, 5.0);

fn scene() -> TestScene {
    TestScene::new(folded_volume(SIZE, DVec3::ONE), opaque_ramp(), few_rays(), ShadingMode::Cao)
}

#[test]
fn what_encloses_everything_leaves_nothing_or_everything() {
    for scale in [20.0, 1e4, 1e7] {
        let around = Transform::from_translation(PLACE).with_scale(Vec3::splat(scale));
        let mut scene = scene();
        scene.settle();
        let (untouched, image) = (scene.occlusion(), scene.headless.image());
        let carver = scene.carve(Sphere::new(5.0), ClipMesh::default(), around);
        scene.settle();
        assert!(is_empty(&scene.headless.image()), "{scale}: something is left");
        assert!(scene.hidden().iter().all(|&hidden| hidden), "{scale}");
        scene.world().entity_mut(carver).insert(ClipMesh::intersect());
        scene.settle();
        assert!(scene.headless.image() == image, "{scale}: a probe around everything shows");
        assert_eq!(count_different(&scene.occlusion(), &untouched), 0, "{scale}");
    }
}

#[test]
fn what_is_far_away_or_tiny_recomputes_nothing() {
    let mut scene = scene();
    if !needs::counters(&mut scene) {
        return;
    }
    scene.settle();
    let (image, hidden) = (scene.headless.image(), scene.hidden());
    assert!(!is_empty(&image));
    let carver = scene.carve(Sphere::new(5.0), ClipMesh::default(), Transform::from_xyz(80.0, 0.0, 0.0));
    scene.settle();
    scene.move_carver(carver, Transform::from_xyz(79.0, 0.0, 0.0));
    assert_eq!(scene.headless.count_work(scene.volume), Work::default(), "far away");
    scene.headless.frame();
    assert!(scene.hidden() == hidden, "it hides something");
    assert!(scene.headless.image() == image);
    for scale in [1e-4, 1e-7] {
        scene.move_carver(carver, Transform::from_translation(PLACE).with_scale(Vec3::splat(scale)));
        scene.headless.frame();
        scene.settle();
        assert!(scene.headless.image() == image, "{scale}: it shows");
    }
}

#[test]
fn what_is_not_finite_carves_nothing_until_it_is() {
    let mut scene = scene();
    scene.settle();
    let untouched = scene.headless.image();
    let carver = scene.carve(Sphere::new(7.0), ClipMesh::default(), Transform::from_translation(PLACE));
    scene.settle();
    let carved = scene.headless.image();
    assert!(carved != untouched);
    let at = Transform::from_translation(PLACE);
    for broken in [
        at.with_scale(Vec3::new(1.0, f32::NAN, 1.0)),
        at.with_translation(Vec3::new(f32::INFINITY, 0.0, 0.0)),
        at.with_rotation(Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0)),
        at.with_scale(Vec3::new(1.0, 0.0, 1.0)),
    ] {
        scene.move_carver(carver, broken);
        scene.headless.frame();
        assert!(scene.headless.image() == untouched, "{broken:?} carves");
        scene.move_carver(carver, at);
        scene.headless.frame();
        assert!(scene.headless.image() == carved, "it is stuck after {broken:?}");
    }
}

#[test]
fn a_carver_exactly_on_the_faces_is_exact() {
    let half = SIZE.as_vec3() * 0.5;
    // Grid axes are x, z and y of the volume.
    let size = Vec3::new(half.x, half.z, half.y) * 2.0;
    let mut scene = scene();
    scene.settle();
    let hidden = scene.hidden();
    let carver = scene.carve(
        Cuboid::from_size(Vec3::new(size.x, size.y, 0.5 * size.z)),
        ClipMesh::default(),
        Transform::from_xyz(0.0, 0.0, 0.25 * size.z),
    );
    assert_exact(&mut scene, "half of the volume");
    // The carver touches the volume from outside.
    scene.move_carver(carver, Transform::from_xyz(0.0, 0.0, 0.75 * size.z));
    scene.settle();
    assert!(scene.hidden() == hidden);
    assert_exact(&mut scene, "touching");
}

#[test]
fn coincident_carvers_carve_like_one() {
    let carve = |count: usize| {
        let mut scene = scene();
        for _ in 0..count {
            scene.carve(Sphere::new(7.0), ClipMesh::default(), Transform::from_translation(PLACE));
        }
        assert_exact(&mut scene, "coincident");
        scene.settle();
        (scene.occlusion(), scene.headless.image(), scene.hidden())
    };
    let (one, three) = (carve(1), carve(3));
    assert!(one.2 == three.2, "not the same is hidden");
    // Voxels that two carvers cut are counted by 41 points, so their coverage is off by up to 0.17. A ray meets this
    // error in one cell only: a few hundredths of the occlusion.
    let known = one.0.iter().zip(&three.0).filter_map(|(a, b)| Some(((*a)?, (*b)?)));
    let largest = known.map(|(a, b)| a.abs_diff(b)).max();
    assert!(largest.is_some_and(|largest| largest <= 12), "{largest:?}");
    // Two and three coincident carvers give exactly the same result.
    assert!(carve(2) == three);
}

#[test]
fn abutting_carvers_leave_no_sheet_between_them() {
    let mut scene = scene();
    for x in [-4.0, 4.0] {
        scene.carve(
            Cuboid::new(8.0, 10.0, 10.0),
            ClipMesh::default(),
            Transform::from_translation(PLACE + Vec3::X * x),
        );
    }
    scene.settle();
    assert_exact(&mut scene, "abutting");
    // The voxels lie where the carvers meet. Grid axis 0 runs towards -x.
    let opacities = scene.opacities();
    let at = |x: f32| {
        let voxel = Vec3::new(12.5 - x, 11.5 + PLACE.z, 10.5 + PLACE.y).round().as_uvec3();
        opacities[((voxel.z * SIZE.y + voxel.y) * SIZE.x + voxel.x) as usize]
    };
    for x in -2..=2 {
        assert_eq!(at(PLACE.x + x as f32), 0, "{x} mm from where they meet");
    }
}

#[test]
fn a_camera_inside_the_hole_sees_its_walls() {
    let mut scene = scene();
    scene.carve(Sphere::new(8.0), ClipMesh::default(), Transform::default());
    let camera = scene.camera();
    scene.world().entity_mut(camera).insert((
        Transform::from_xyz(0.002, 0.001, 0.0).looking_at(Vec3::new(0.01, 0.003, -0.02), Vec3::Y),
        Projection::Perspective(PerspectiveProjection { near: 1e-4, fov: 1.4, ..default() }),
    ));
    assert_exact(&mut scene, "inside the hole");
}
