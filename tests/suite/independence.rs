//! The occlusion does not depend on the carvers' path, their order or the camera (DESIGN, section 5). Nor does it
//! depend on earlier edits.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::mode::ShadingMode;

use crate::scene::{
    FEW_RAYS, TestScene, count_different, few_rays, folded_volume, opaque_ramp, translucent_ramp,
};

fn scene() -> TestScene {
    let volume = folded_volume(UVec3::new(28, 25, 23), DVec3::ONE);
    TestScene::new(volume, translucent_ramp(), few_rays(), ShadingMode::Cao)
}

fn poses() -> [Transform; 2] {
    let turned = Quat::from_euler(EulerRot::XYZ, 0.3, 0.8, -0.5);
    [Transform::from_xyz(5.0, 4.0, 3.0), Transform::from_xyz(1.0, 6.0, 4.0).with_rotation(turned)]
}

fn shapes() -> [Mesh; 2] {
    [Sphere::new(6.0).into(), Cuboid::new(7.0, 9.0, 8.0).into()]
}

fn carve_both(scene: &mut TestScene, order: [usize; 2]) {
    for k in order {
        scene.carve(shapes()[k].clone(), ClipMesh::default(), poses()[k]);
    }
}

#[test]
fn the_path_and_the_order_of_carvers_leave_no_trace() {
    let mut fresh = scene();
    carve_both(&mut fresh, [0, 1]);
    fresh.settle();
    let expected = fresh.occlusion();

    let mut reversed = scene();
    carve_both(&mut reversed, [1, 0]);
    reversed.settle();
    assert_eq!(count_different(&reversed.occlusion(), &expected), 0, "the order of spawning shows");

    let mut walked = scene();
    let carvers: Vec<_> = shapes()
        .into_iter()
        .map(|mesh| walked.carve(mesh, ClipMesh::default(), Transform::default()))
        .collect();
    walked.settle();
    for step in 0..12u32 {
        let angle = step as f32 * 0.7;
        let away = Transform::from_xyz(9.0 * angle.sin(), 7.0 * angle.cos(), step as f32 - 6.0)
            .with_rotation(Quat::from_rotation_y(angle))
            .with_scale(Vec3::splat(1.0 + 0.05 * step as f32));
        walked.move_carver(carvers[step as usize % 2], away);
        walked.headless.frame();
    }
    for (carver, pose) in carvers.into_iter().zip(poses()) {
        walked.move_carver(carver, pose);
    }
    walked.headless.frame();
    assert_eq!(count_different(&walked.occlusion(), &expected), 0, "the path shows");
}

#[test]
fn cameras_do_not_change_a_voxel() {
    let mut scene = scene();
    carve_both(&mut scene, [0, 1]);
    scene.settle();
    let (before, image) = (scene.occlusion(), scene.headless.image());
    let world = scene.world();
    let camera = world.query_filtered::<Entity, With<Camera3d>>().single(world).expect("one camera");
    world.entity_mut(camera).insert(Transform::from_xyz(-0.03, 0.04, 0.02).looking_at(Vec3::ZERO, Vec3::Y));
    scene.headless.frame();
    assert!(scene.headless.image() != image, "the view did not change");
    assert_eq!(count_different(&scene.occlusion(), &before), 0, "the view shows in the occlusion");
}

#[test]
fn edits_and_moves_at_once_leave_no_trace() {
    let carver = || (Mesh::from(Sphere::new(7.0)), ClipMesh::default(), Transform::from_xyz(5.0, 4.0, 3.0));
    let mut direct = scene();
    let (mesh, clip_mesh, pose) = carver();
    direct.carve(mesh, clip_mesh, pose);
    direct.settle();

    let volume = folded_volume(UVec3::new(28, 25, 23), DVec3::ONE);
    let mut edited = TestScene::new(volume, opaque_ramp(), few_rays(), ShadingMode::Cao);
    let (mesh, clip_mesh, _) = carver();
    let moving = edited.carve(mesh, clip_mesh, Transform::default());
    edited.settle();
    // One frame changes the transfer function, the mode, the pose and the reach.
    let volume = edited.volume;
    let world = edited.world();
    let function = world.get::<VolumeTransferFunction>(volume).expect("the transfer function").clone();
    let _ = world.resource_mut::<Assets<TransferFunction>>().insert(&function.0, translucent_ramp());
    world.entity_mut(volume).insert(AmbientOcclusion::by(OcclusionRays { steps: 9, ..FEW_RAYS }));
    edited.set_mode(ShadingMode::PhongCao);
    edited.move_carver(moving, pose);
    edited.headless.frame();
    edited.set_mode(ShadingMode::Cao);
    edited.world().entity_mut(volume).insert(few_rays());
    edited.headless.frames(2);
    assert_eq!(count_different(&edited.occlusion(), &direct.occlusion()), 0, "the way there shows");
    assert!(edited.headless.image() == direct.headless.image(), "the way there shows");
}
