//! What the occlusion does not depend on: the carvers' path, their order, the camera (DESIGN,
//! section 5), and the portions in which the unclipped occlusion is computed.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{diagnostics::SPAN_PRECOMPUTE, prelude::*, render::VolumeTexture};

use crate::scene::{TestScene, few_rays, folded_volume, opaque_ramp, translucent_ramp};

fn scene() -> TestScene {
    let volume = folded_volume(UVec3::new(28, 25, 23), DVec3::ONE);
    TestScene::new(volume, translucent_ramp(), few_rays(), ShadingMode::Cao)
}

/// Occlusion of the voxels that can be read, the others as 0.
fn sampled(scene: &TestScene) -> Vec<u8> {
    let categories = scene.categories();
    scene
        .occlusion()
        .iter()
        .zip(&categories)
        .map(|(value, category)| if *category == 0 { 0 } else { *value })
        .collect()
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
    let expected = sampled(&fresh);

    let mut reversed = scene();
    carve_both(&mut reversed, [1, 0]);
    reversed.settle();
    assert!(sampled(&reversed) == expected, "the order of spawning shows");

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
    assert!(sampled(&walked) == expected, "the path shows");
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
    assert!(scene.occlusion() == before, "the view shows in the occlusion");
}

#[test]
fn portions_carving_and_edits_meanwhile_leave_no_trace() {
    // 64^3 voxels, 36 rays of 10 steps: 94 million samples, several frames' worth.
    let many = || AmbientOcclusion { pattern: RayPattern::Fibonacci(36), steps: 10, step_mm: 1.0 };
    let start = |function| {
        TestScene::new(folded_volume(UVec3::splat(64), DVec3::ONE), function, many(), ShadingMode::Cao)
    };
    let carver =
        || (Mesh::from(Sphere::new(14.0)), ClipMesh::default(), Transform::from_xyz(10.0, 12.0, 14.0));

    let mut direct = start(translucent_ramp());
    let (mesh, clip_mesh, pose) = carver();
    direct.carve(mesh, clip_mesh, pose);
    direct.settle();
    direct.headless.frame();
    assert!(direct.status().passes.jobs(SPAN_PRECOMPUTE) > 1, "it was computed in one go");

    let mut edited = start(opaque_ramp());
    let (mesh, clip_mesh, _) = carver();
    let moving = edited.carve(mesh, clip_mesh, Transform::default());
    let volume = edited.volume;
    let progress =
        |scene: &mut TestScene| scene.world().get::<OcclusionProgress>(volume).map_or(0.0, |p| p.0);
    for _ in 0..50 {
        edited.headless.frame();
        if progress(&mut edited) > 0.0 {
            break;
        }
    }
    let part = progress(&mut edited);
    assert!(part > 0.0 && part < 1.0, "{part} is no progress to be watched");
    // In the middle of it: another transfer function, another mode, another pose.
    let world = edited.world();
    let function = world.get::<VolumeTransferFunction>(volume).expect("the transfer function").clone();
    let _ = world.resource_mut::<Assets<TransferFunction>>().insert(&function.0, translucent_ramp());
    edited.headless.frame();
    edited.set_mode(ShadingMode::PhongCao);
    edited.move_carver(moving, pose);
    edited.headless.frame();
    edited.set_mode(ShadingMode::Cao);
    edited.settle();
    assert!(sampled(&edited) == sampled(&direct), "the way there shows");
    let unclipped =
        |scene: &TestScene| scene.headless.voxels(scene.volume, VolumeTexture::UnclippedOcclusion);
    assert!(unclipped(&edited) == unclipped(&direct));
}
