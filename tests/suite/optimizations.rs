//! Optimizations do not show. With all of them, or all but one, every bit of the image and the occlusion is as
//! without any.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::occlusion::Optimizations;
use bevy_contextual_ao::{diagnostics::Work, prelude::*};
use contextual_ao_kit::mode::ShadingMode;

use crate::needs;
use crate::scene::{
    FEW_RAYS, TestScene, count_different, few_rays, folded_volume, in_world_units, is_empty, opaque_ramp,
    translucent_ramp,
};

const SIZE: UVec3 = UVec3::new(38, 33, 29);

fn scene(function: TransferFunction, spacing: DVec3, optimizations: Optimizations) -> TestScene {
    TestScene::with(folded_volume(SIZE, spacing), function, few_rays(), ShadingMode::Cao, |app| {
        app.insert_resource(optimizations);
    })
}

/// Carves with three shapes, of which two move. Returns the final occlusion and image.
fn carved(mut scene: TestScene) -> (Vec<Option<u8>>, Vec<u8>) {
    let at = |x: f32, y: f32| Transform::from_xyz(x, y, 5.0).with_rotation(Quat::from_rotation_x(x));
    let mut carve = |mesh: Mesh, clip_mesh| scene.carve(mesh, clip_mesh, at(9.0, 0.0));
    let sphere = carve(Sphere::new(7.0).into(), ClipMesh::default());
    let block = carve(Cuboid::new(8.0, 9.0, 30.0).into(), ClipMesh::default());
    carve(Sphere::new(24.0).into(), ClipMesh::intersect());
    scene.settle();
    for step in 0..4 {
        scene.move_carver(sphere, at(6.0 - 3.0 * step as f32, 4.0));
        scene.move_carver(block, at(-4.0, 2.0 * step as f32));
        scene.headless.frame();
    }
    (scene.occlusion(), scene.headless.image())
}

#[test]
fn no_optimization_changes_a_bit() {
    for (name, function, spacing) in [
        ("opaque", opaque_ramp(), DVec3::ONE),
        ("translucent, anisotropic", translucent_ramp(), DVec3::new(1.0, 0.8, 1.9)),
    ] {
        let published = carved(scene(function.clone(), spacing, Optimizations::NONE));
        assert!(!is_empty(&published.1));
        let all = (String::from("all optimizations"), Optimizations::default());
        let each = Optimizations::names().map(|without| {
            let rest = Optimizations::default().without(without).expect("an optimization of that name");
            (format!("all but {without}"), rest)
        });
        for (which, optimizations) in each.chain([all]) {
            let (occlusion, image) = carved(scene(function.clone(), spacing, optimizations));
            assert_eq!(count_different(&occlusion, &published.0), 0, "{name}, {which}");
            assert!(image == published.1, "{name}, {which}: the image is not the same");
        }
    }
}

/// Work of a frame in which a carver moves.
fn work_of_a_carve(optimizations: Optimizations) -> Work {
    let mut scene = scene(opaque_ramp(), DVec3::ONE, optimizations);
    let at = |x| Transform::from_xyz(x, 6.0, 7.0);
    let carver = scene.carve(Sphere::new(7.0), ClipMesh::default(), at(6.0));
    scene.settle();
    scene.move_carver(carver, at(5.0));
    scene.headless.count_work(scene.volume)
}

#[test]
fn optimizations_save_samples() {
    if !needs::counters(&mut scene(opaque_ramp(), DVec3::ONE, Optimizations::NONE)) {
        return;
    }
    let published = work_of_a_carve(Optimizations::NONE);
    let all = work_of_a_carve(Optimizations::default());
    let steps_and_rays = u64::from(FEW_RAYS.steps * FEW_RAYS.pattern.rays());
    assert_eq!(published.samples, published.voxels * steps_and_rays, "the published rays are full");
    assert!(all.voxels > 0 && 2 * all.voxels < published.voxels, "{all:?} of {published:?}");
    assert!(3 * all.samples < published.samples, "{all:?} of {published:?}");
    for name in ["demand", "early_end", "leaps"] {
        let optimizations = Optimizations::default().without(name).expect("an optimization of that name");
        let without = work_of_a_carve(optimizations);
        assert!(without.samples > all.samples, "without {name}: {without:?}, with all {all:?}");
    }
    let everywhere = Optimizations { demand: false, sampleable: false, ..default() };
    let sampleable = Optimizations { demand: false, ..default() };
    assert!(work_of_a_carve(everywhere).voxels > work_of_a_carve(sampleable).voxels);
}

#[test]
fn a_view_casts_what_it_sees_and_has_not_seen() {
    let mut scene = scene(opaque_ramp(), DVec3::ONE, Optimizations::default());
    if !needs::counters(&mut scene) {
        return;
    }
    scene.settle();
    let first = scene.occlusion().iter().flatten().count();
    let camera = scene.camera();
    let (volume, size) = (scene.volume, SIZE.as_vec3().length());
    let mut look_from = |direction: Vec3| {
        let place = Transform::from_translation(direction * size).looking_at(Vec3::ZERO, Vec3::Y);
        let place = Transform { scale: Vec3::ONE, ..in_world_units(place) };
        scene.world().entity_mut(camera).insert(place);
        scene.headless.count_work(volume)
    };
    let aside = look_from(Vec3::new(0.62, 0.5, 1.2));
    let behind = look_from(Vec3::new(-0.6, 0.5, -1.2));
    let again = look_from(Vec3::new(0.62, 0.5, 1.2));
    assert!((aside.voxels as usize) < first / 4, "a small step: {aside:?}, at first {first}");
    assert!(behind.voxels > aside.voxels, "the other side: {behind:?}");
    assert_eq!(again, Work::default(), "all of that had been seen");
}

#[test]
fn a_carve_leaves_nothing_uncast_that_is_seen() {
    let mut scene = scene(opaque_ramp(), DVec3::ONE, Optimizations::default());
    if !needs::counters(&mut scene) {
        return;
    }
    // Another volume has a longer reach. The carvers' maps are made for that reach.
    let volume = scene.volume;
    let world = scene.world();
    world.entity_mut(volume).insert(AmbientOcclusion::by(OcclusionRays { steps: 1, ..FEW_RAYS }));
    let data = world.resource_mut::<Assets<Volume>>().add(folded_volume(SIZE, DVec3::ONE));
    let mut other = VolumeBundle::new(data);
    other.occlusion = AmbientOcclusion::by(OcclusionRays { steps: 20, ..FEW_RAYS });
    other.transform.translation.x = 0.1;
    world.spawn(other);
    let at = |x| Transform::from_xyz(x, 15.0, 13.0);
    let carver = scene.carve(Sphere::new(2.0), ClipMesh::default(), at(18.0));
    scene.settle();
    for step in 1..4 {
        scene.move_carver(carver, at(18.0 - step as f32));
        scene.headless.frame();
    }
    // When the whole view is followed anew, it asks for no voxel.
    scene.set_mode(ShadingMode::Solid);
    scene.headless.frame();
    scene.set_mode(ShadingMode::Cao);
    assert_eq!(scene.headless.count_work(volume), Work::default());
}
