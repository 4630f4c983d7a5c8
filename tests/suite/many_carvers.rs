//! Carvers come and go. The first spawned carvers keep carving, and only changed carvers are drawn again.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{
    clip::MAX_CARVERS,
    diagnostics::{SPAN_DEPTH, SPAN_DILATE},
    prelude::*,
};
use contextual_ao_kit::mode::ShadingMode;

use crate::scene::{TestScene, few_rays, folded_volume, opaque_ramp};
use contextual_ao_kit::headless::different_pixels;

/// Carvers that get fewer layers than they have.
#[derive(Resource, Default)]
struct CutOff(Vec<ClipMeshCutOff>);

fn scene(depth_map_size: u32) -> TestScene {
    let volume = folded_volume(UVec3::new(26, 24, 22), DVec3::ONE);
    let mut scene = TestScene::new(volume, opaque_ramp(), few_rays(), ShadingMode::Cao);
    scene.set_clip(|clip| clip.depth_map_size = depth_map_size);
    scene.headless.app.init_resource::<CutOff>().add_observer(
        |event: On<ClipMeshCutOff>, mut cut_off: ResMut<CutOff>| cut_off.0.push(*event.event()),
    );
    scene
}

fn near() -> Transform {
    Transform::from_xyz(4.0, 3.0, 4.0)
}

fn place(index: u32) -> Transform {
    let angle = index as f32;
    Transform::from_xyz(8.0 * angle.cos(), 8.0 * angle.sin(), 5.0)
}

#[test]
fn past_the_most_carvers_those_that_were_spawned_first_carve() {
    let mut scene = scene(16);
    let first = scene.carve(Sphere::new(7.0), ClipMesh::default(), near());
    scene.settle();
    scene.headless.frame();
    let carved = scene.headless.image();
    let far = Transform::from_xyz(900.0, 0.0, 0.0);
    for _ in 1..=MAX_CARVERS {
        scene.carve(Sphere::new(2.0), ClipMesh::default(), far);
    }
    // This carver is one too many. It does not carve, wherever it is.
    let last = scene.carve(Sphere::new(7.0), ClipMesh::default(), Transform::from_xyz(-4.0, -3.0, 4.0));
    scene.settle();
    scene.headless.frames(2);
    assert_eq!(different_pixels(&scene.headless.image(), &carved), 0, "the first carver stopped");
    let told = scene.world().resource::<CutOff>().0.last().map(|event| (event.entity, event.gets_layers));
    assert_eq!(told, Some((last, 0)));
    scene.world().despawn(first);
    scene.headless.frames(2);
    assert!(different_pixels(&scene.headless.image(), &carved) > 100);
}

#[test]
fn past_the_budget_the_first_carvers_carve_and_the_others_are_told() {
    let mut scene = scene(256);
    scene.headless.frame();
    let first = [0, 1].map(|k| scene.carve(Sphere::new(5.0), ClipMesh::default(), place(k)));
    scene.settle();
    scene.headless.frames(2);
    let carved = scene.headless.image();
    // The budget is little more than the present use: room for two layers, but not for a third.
    let max_bytes = scene.status().usage.bytes + 100_000;
    scene.world().resource_mut::<VolumeBudget>().max_bytes = max_bytes;
    let third = scene.carve(Sphere::new(5.0), ClipMesh::default(), place(2));
    scene.settle();
    scene.headless.frames(2);
    assert_eq!(different_pixels(&scene.headless.image(), &carved), 0);
    assert!(scene.status().usage.bytes <= max_bytes, "{:?}", scene.status().usage);
    let told: Vec<_> =
        scene.world().resource::<CutOff>().0.iter().map(|event| (event.entity, event.gets_layers)).collect();
    assert_eq!(told, [(third, 0)]);
    // The third carver carves when there is room.
    scene.world().despawn(first[0]);
    scene.settle();
    scene.headless.frames(2);
    assert!(different_pixels(&scene.headless.image(), &carved) > 100);
}

#[test]
fn a_carver_that_comes_or_goes_leaves_the_maps_of_the_others() {
    for mesh_layers in [1, 2] {
        // A sphere has one layer. Two spheres, one behind the other, have two.
        let mesh = |_: u32| -> Mesh {
            let ball = Sphere::new(3.0).mesh().build();
            if mesh_layers == 1 {
                return ball;
            }
            let mut both = ball.clone();
            both.merge(&ball.translated_by(Vec3::new(8.0, 0.0, 0.0))).expect("meshes of one kind");
            both.merge(&Sphere::new(3.0).mesh().build().translated_by(Vec3::new(0.0, 8.0, 0.0)))
                .expect("meshes of one kind");
            both
        };
        for count in [1, 2, 4] {
            let mut scene = scene(64);
            let carvers: Vec<_> =
                (0..count).map(|k| scene.carve(mesh(k), ClipMesh::default(), place(k))).collect();
            scene.settle();
            scene.headless.frames(3);
            let before = scene.status().passes;
            let without = scene.headless.image();
            let added = scene.carve(mesh(count), ClipMesh::default(), place(count));
            scene.settle();
            scene.headless.frames(3);
            let with = scene.status().passes;
            assert_eq!(with.jobs(SPAN_DEPTH) - before.jobs(SPAN_DEPTH), 1, "depth maps, one beside {count}");
            let dilated = with.jobs(SPAN_DILATE) - before.jobs(SPAN_DILATE);
            assert!((1..=2).contains(&dilated), "{dilated} layers dilated, one carver beside {count}");
            let image = scene.headless.image();

            scene.world().despawn(added);
            scene.headless.frames(3);
            let gone = scene.status().passes;
            assert_eq!(gone.jobs(SPAN_DEPTH), with.jobs(SPAN_DEPTH), "depth maps when it goes, {count} left");
            assert_eq!(gone.jobs(SPAN_DILATE), with.jobs(SPAN_DILATE), "dilation when it goes, {count} left");
            assert_eq!(different_pixels(&scene.headless.image(), &without), 0);

            // The first carver goes, and its layers with it. The other carvers move into fewer layers.
            let last = scene.carve(mesh(count), ClipMesh::default(), place(count));
            scene.settle();
            scene.headless.frames(3);
            assert_eq!(different_pixels(&scene.headless.image(), &image), 0);
            scene.world().despawn(carvers[0]);
            scene.headless.frames(3);
            let mut fresh = self::scene(64);
            for k in 1..=count {
                fresh.carve(mesh(k), ClipMesh::default(), place(k));
            }
            fresh.settle();
            fresh.headless.frames(3);
            assert_eq!(different_pixels(&scene.headless.image(), &fresh.headless.image()), 0);
            scene.world().despawn(last);
        }
    }
}
