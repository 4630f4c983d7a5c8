//! Occlusion methods that other plugins add.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{prelude::*, render::VolumeTexture, render::VoxelMethodPlugin};
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    headless::different_pixels,
    scene::{FEW_RAYS, TestScene, folded_volume, opaque_ramp},
    toy_method::{Openness, OpennessMethod},
};

const SIZE: UVec3 = UVec3::new(20, 18, 22);

fn scene(method: OcclusionMethod, setup: impl FnOnce(&mut App)) -> TestScene {
    let volume = folded_volume(SIZE, DVec3::ONE);
    let occlusion = AmbientOcclusion::by(method);
    TestScene::with(volume, opaque_ramp(), occlusion, ShadingMode::Cao, setup)
}

fn openness(distance_voxels: u32) -> OcclusionMethod {
    OcclusionMethod::custom(Openness { distance_voxels })
}

/// Adds the method in one line.
fn add(app: &mut App) {
    app.add_plugins(VoxelMethodPlugin::<OpennessMethod>::default());
}

fn set(scene: &mut TestScene, method: OcclusionMethod) {
    let volume = scene.volume;
    scene.world().get_mut::<AmbientOcclusion>(volume).expect("occlusion").method = method;
}

/// Occlusion factors (bytes) that the shader should compute from the scene's opacities.
fn expected(scene: &TestScene, distance: i32) -> Vec<f64> {
    let opacities = scene.opacities();
    let size = SIZE.as_ivec3();
    let transparency = |voxel: IVec3| {
        let is_inside = voxel.cmpge(IVec3::ZERO).all() && voxel.cmplt(size).all();
        let index = voxel.x + size.x * (voxel.y + size.y * voxel.z);
        255.0 - if is_inside { f64::from(opacities[index as usize]) } else { 0.0 }
    };
    let voxels = (0..SIZE.element_product() as i32)
        .map(|k| IVec3::new(k % size.x, k / size.x % size.y, k / (size.x * size.y)));
    let steps = [IVec3::X, IVec3::Y, IVec3::Z].map(|axis| axis * distance);
    voxels
        .map(|voxel| {
            steps.map(|step| transparency(voxel - step) + transparency(voxel + step)).iter().sum::<f64>()
                / 6.0
        })
        .collect()
}

fn check(scene: &TestScene, distance: i32) {
    let found = scene.headless.voxels(scene.volume, VolumeTexture::Occlusion);
    let expected = expected(scene, distance);
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.into_iter().zip(expected) {
        // Factors are rounded to a byte. Their sums are rounded to a 2^23rd.
        assert!((f64::from(found) - expected).abs() < 0.501, "{found}, not {expected}");
    }
}

#[test]
fn a_method_of_another_plugin_computes_what_is_drawn() {
    let mut scene = scene(openness(1), add);
    let carver = scene.carve(Sphere::new(6.0), ClipMesh::default(), Transform::from_xyz(5.0, 2.0, 6.0));
    scene.settle();
    check(&scene, 1);
    let runs = |scene: &TestScene| scene.status().passes.jobs(Openness::SPAN);
    // Passes that ran are reported one frame later.
    scene.headless.frame();
    let (image, before) = (scene.headless.image(), runs(&scene));
    assert_eq!(before, 1);
    scene.headless.frames(3);
    assert_eq!(runs(&scene), before, "nothing changed");
    // A moved carver and changed settings are drawn in the same frame.
    scene.move_carver(carver, Transform::from_xyz(3.0, 2.0, 6.0));
    scene.headless.frame();
    check(&scene, 1);
    assert!(different_pixels(&scene.headless.image(), &image) > 100);
    set(&mut scene, openness(3));
    scene.headless.frame();
    check(&scene, 3);
    // The scene switches back to a method of this crate.
    set(&mut scene, FEW_RAYS.into());
    scene.settle();
    let rays = scene.headless.image();
    let mut only_rays = self::scene(FEW_RAYS.into(), |_| {});
    only_rays.carve(Sphere::new(6.0), ClipMesh::default(), Transform::from_xyz(3.0, 2.0, 6.0));
    only_rays.settle();
    assert_eq!(different_pixels(&rays, &only_rays.headless.image()), 0);
}

#[test]
fn without_its_plugin_a_volume_is_drawn_without_occlusion() {
    let mut scene = scene(openness(1), |_| {});
    scene.headless.frames(5);
    let unknown = scene.headless.image();
    scene.set_mode(ShadingMode::Solid);
    scene.headless.frame();
    assert_eq!(different_pixels(&unknown, &scene.headless.image()), 0);
}
