//! Carvers and volumes that come, move and go leave no stale values and no textures, and cause no needless work.

use bevy::{core_pipeline::Core3d, math::DVec3, prelude::*};
use bevy_contextual_ao::{
    diagnostics::{
        GpuUsage, SPAN_CLIP, SPAN_COUNT, SPAN_CULL, SPAN_DEPTH, SPAN_DILATE, SPAN_DISTANCES, SPAN_MARCH,
        SPAN_RANGES,
    },
    prelude::*,
};
use contextual_ao_kit::mode::ShadingMode;

use crate::scene::{
    TestScene, count_different, few_rays, folded_volume, is_empty, opaque_ramp, translucent_ramp,
};
use contextual_ao_kit::shapes::Triangles;

const SIZE: UVec3 = UVec3::new(26, 24, 22);

fn scene() -> TestScene {
    TestScene::new(folded_volume(SIZE, DVec3::ONE), opaque_ramp(), few_rays(), ShadingMode::Cao)
}

fn at(x: f32) -> Transform {
    Transform::from_xyz(x, 3.0, 4.0)
}

#[test]
fn a_frame_at_rest_runs_no_pass_and_changes_no_pixel() {
    let mut scene = scene();
    let carver = scene.carve(Sphere::new(6.0), ClipMesh::default(), at(4.0));
    scene.settle();
    scene.headless.frame();
    let (before, image) = (scene.status().passes, scene.headless.image());
    scene.headless.frames(3);
    assert_eq!(scene.status().passes, before);
    assert!(scene.headless.image() == image, "differs");

    // Moving and turning renders no maps again. Resizing dilates the maps. A new mesh renders them.
    scene.move_carver(carver, at(2.0).with_rotation(Quat::from_rotation_x(0.7)));
    scene.headless.frame();
    scene.headless.frame();
    let moved = scene.status().passes;
    for (span, jobs) in [(SPAN_DEPTH, 0), (SPAN_DILATE, 0), (SPAN_CLIP, 1), (OcclusionRays::SPAN_CAST, 1)] {
        assert_eq!(moved.jobs(span) - before.jobs(span), jobs, "{span} when moved");
    }
    assert!(scene.headless.image() != image, "is the same");
    scene.move_carver(carver, at(2.0).with_scale(Vec3::new(1.0, 1.3, 1.0)));
    scene.headless.frame();
    scene.headless.frame();
    let scaled = scene.status().passes;
    assert_eq!(scaled.jobs(SPAN_DEPTH), moved.jobs(SPAN_DEPTH));
    assert_eq!(scaled.jobs(SPAN_DILATE), moved.jobs(SPAN_DILATE) + 1);
    let mesh = scene.world().resource_mut::<Assets<Mesh>>().add(Cuboid::new(5.0, 6.0, 7.0));
    scene.world().entity_mut(carver).insert(Mesh3d(mesh));
    scene.settle();
    scene.headless.frame();
    for span in [SPAN_COUNT, SPAN_DEPTH] {
        assert_eq!(scene.status().passes.jobs(span), moved.jobs(span) + 1, "{span} for a new mesh");
    }
}

#[test]
fn the_old_mesh_carves_until_the_new_one_is_known() {
    let mut scene = scene();
    scene.settle();
    let untouched = scene.headless.image();
    // The bowl has two layers, so that there are layers to lose.
    let bowl = || Triangles::bowl(9.0, 6.0, 32).rotated(Quat::from_rotation_x(1.1));
    let carver = scene.carve_with(&bowl(), at(4.0));
    scene.settle();
    scene.headless.frame();
    let before = scene.headless.image();
    assert!(before != untouched && scene.status().clip_layers == 2);
    let mesh = scene.world().resource_mut::<Assets<Mesh>>().add(bowl().scaled(Vec3::splat(0.8)).mesh());
    scene.world().entity_mut(carver).insert(Mesh3d(mesh));
    let mut images = Vec::new();
    for _ in 0..8 {
        scene.headless.frame();
        images.push(scene.headless.image());
    }
    let after = images.last().cloned().unwrap_or_default();
    assert!(after != before && after != untouched);
    assert!(images.iter().all(|image| *image == before || *image == after), "it did not carve meanwhile");
}

#[test]
fn a_carve_is_complete_in_the_frame_of_the_move() {
    let mut scene = scene();
    let carver = scene.carve(Sphere::new(6.0), ClipMesh::default(), at(4.0));
    scene.settle();
    let before = scene.headless.image();
    for x in [1.0, -2.0, 3.0] {
        scene.move_carver(carver, at(x));
        scene.headless.frame();
        let (image, occlusion) = (scene.headless.image(), scene.occlusion());
        assert!(image != before, "the move does not show");
        scene.headless.frame();
        assert!(scene.headless.image() == image && scene.occlusion() == occlusion, "it was not complete");
    }
}

#[test]
fn compute_runs_once_for_two_cameras() {
    #[derive(Resource, Default)]
    struct Views(u32);
    let mut scene = scene();
    let carver = scene.carve(Sphere::new(6.0), ClipMesh::default(), at(4.0));
    let camera = scene.headless.camera();
    scene.world().spawn((camera, Transform::from_xyz(0.0, 0.05, 0.05).looking_at(Vec3::ZERO, Vec3::Y)));
    scene.headless.app.sub_app_mut(bevy::render::RenderApp).init_resource::<Views>();
    scene.headless.add_render_system(Core3d, |mut views: ResMut<Views>| views.0 += 1);
    scene.settle();
    scene.headless.frame();
    let before = scene.status().passes;
    let views_before = views(&scene);
    scene.move_carver(carver, at(3.0));
    scene.headless.frame();
    scene.headless.frame();
    let after = scene.status().passes;
    assert_eq!(views(&scene) - views_before, 4, "two cameras, two frames");
    assert_eq!(after.jobs(SPAN_CLIP) - before.jobs(SPAN_CLIP), 1);
    assert_eq!(after.jobs(OcclusionRays::SPAN_CAST) - before.jobs(OcclusionRays::SPAN_CAST), 1);

    fn views(scene: &TestScene) -> u32 {
        scene.headless.app.sub_app(bevy::render::RenderApp).world().resource::<Views>().0
    }
}

#[test]
fn carvers_that_move_and_go_leave_nothing_behind() {
    let mut scene = scene();
    scene.settle();
    let (untouched, image) = (scene.occlusion(), scene.headless.image());
    scene.headless.frame();
    let usage = scene.status().usage;
    let carvers: Vec<_> = (0..5)
        .map(|k| scene.carve(Sphere::new(3.0 + k as f32), ClipMesh::default(), at(3.0 * k as f32 - 6.0)))
        .collect();
    for step in 0..3 {
        for (k, &carver) in carvers.iter().enumerate() {
            scene.move_carver(carver, at((k * 5 + step * 3) as f32 % 17.0 - 8.0));
        }
        scene.headless.frame();
    }
    assert!(scene.headless.image() != image, "is the same");
    assert!(scene.status().usage.bytes > usage.bytes);
    for carver in carvers {
        scene.world().entity_mut(carver).remove::<ClipMesh>();
    }
    scene.headless.frame();
    scene.headless.frame();
    assert_eq!(count_different(&scene.occlusion(), &untouched), 0);
    assert!(scene.headless.image() == image, "differs");
    scene.headless.frame();
    assert_eq!(scene.status().usage, usage);
}

#[test]
fn a_new_volume_under_the_same_entity_is_as_a_fresh_start() {
    let other = || folded_volume(UVec3::new(19, 30, 17), DVec3::new(1.2, 0.8, 1.1));
    let mut fresh = TestScene::new(other(), translucent_ramp(), few_rays(), ShadingMode::Cao);
    fresh.carve(Sphere::new(6.0), ClipMesh::default(), at(4.0));
    fresh.settle();

    let mut scene = scene();
    scene.carve(Sphere::new(6.0), ClipMesh::default(), at(4.0));
    scene.settle();
    let volume = scene.volume;
    let world = scene.world();
    let data = world.resource_mut::<Assets<Volume>>().add(other());
    let function = world.resource_mut::<Assets<TransferFunction>>().add(translucent_ramp());
    world.entity_mut(volume).insert((Volume3d(data), VolumeTransferFunction(function)));
    scene.headless.frame();
    scene.headless.frame();
    scene.settle();
    assert_eq!(count_different(&scene.occlusion(), &fresh.occlusion()), 0);
    fresh.headless.frame();
    scene.headless.frame();
    // Room for what views see depends on the views before.
    let usage = |scene: &TestScene| GpuUsage { view_bytes: 0, ..scene.status().usage };
    assert_eq!(usage(&scene), usage(&fresh));

    // The volume and its transfer function are edited in place.
    let world = scene.world();
    let handles =
        (world.get::<Volume3d>(volume).cloned(), world.get::<VolumeTransferFunction>(volume).cloned());
    let (Some(data), Some(function)) = handles else { panic!("the volume keeps its handles") };
    let _ = world.resource_mut::<Assets<Volume>>().insert(&data.0, folded_volume(SIZE, DVec3::ONE));
    let _ = world.resource_mut::<Assets<TransferFunction>>().insert(&function.0, opaque_ramp());
    scene.headless.frames(3);
    scene.settle();
    let mut first = self::scene();
    first.carve(Sphere::new(6.0), ClipMesh::default(), at(4.0));
    first.settle();
    assert_eq!(count_different(&scene.occlusion(), &first.occlusion()), 0);
}

#[test]
fn volumes_go_with_their_entity() {
    let mut scene = scene();
    scene.settle();
    let one = scene.status().usage;
    assert!(!is_empty(&scene.headless.image()));
    let data = scene.world().resource_mut::<Assets<Volume>>().add(folded_volume(SIZE, DVec3::ONE));
    let second = scene.world().spawn(VolumeBundle::new(data)).id();
    scene.headless.frames(4);
    assert_eq!(scene.status().usage.textures, one.textures + 6);
    scene.world().despawn(second);
    let volume = scene.volume;
    // Removing the component has the effect of despawning.
    scene.world().entity_mut(volume).remove::<Volume3d>();
    scene.headless.frames(3);
    let none = scene.status().usage;
    assert_eq!(none.textures, 6, "only the clip maps stay: {none:?}");
    assert!(is_empty(&scene.headless.image()));
    assert!(scene.world().get::<Mesh3d>(volume).is_none());
}

#[test]
fn a_carver_can_be_restricted_to_some_volumes() {
    let mut scene = scene();
    scene.settle();
    let untouched = scene.headless.image();
    let volume = scene.volume;
    let elsewhere = scene.world().spawn_empty().id();
    let only = |entity| ClipMesh { targets: ClipTargets::Only(vec![entity]), ..default() };
    let carver = scene.carve(Sphere::new(8.0), only(elsewhere), at(4.0));
    scene.headless.frame();
    scene.headless.frame();
    assert!(scene.headless.image() == untouched, "differs");
    scene.world().entity_mut(carver).insert(only(volume));
    // The first frame with any carver compiles the pipeline of the depth maps.
    scene.headless.frame();
    scene.headless.frame();
    assert!(scene.headless.image() != untouched, "is the same");
}

#[test]
fn progress_can_be_watched_and_ends_with_an_event() {
    #[derive(Resource, Default)]
    struct Occluded(u32);
    let mut scene = TestScene::with(
        folded_volume(SIZE, DVec3::ONE),
        opaque_ramp(),
        few_rays(),
        ShadingMode::Cao,
        |app| {
            app.init_resource::<Occluded>()
                .add_observer(|_: On<VolumeOccluded>, mut occluded: ResMut<Occluded>| occluded.0 += 1);
        },
    );
    let volume = scene.volume;
    let ready = |scene: &mut TestScene| scene.world().get::<OcclusionReady>(volume).map(|ready| ready.0);
    scene.headless.frame();
    assert_eq!(ready(&mut scene), Some(false));
    assert_eq!(scene.world().resource::<Occluded>().0, 0);
    scene.settle();
    assert_eq!(ready(&mut scene), Some(true));
    assert_eq!(scene.world().resource::<Occluded>().0, 1);
    // No pass runs for carvers' meshes or for other methods.
    scene.headless.frame();
    let passes = scene.status().passes;
    let expected = [
        SPAN_RANGES,
        SPAN_CULL,
        SPAN_CLIP,
        SPAN_DISTANCES,
        SPAN_MARCH,
        OcclusionRays::SPAN_MARK,
        OcclusionRays::SPAN_CAST,
    ];
    assert_eq!(passes.spans().collect::<Vec<_>>(), expected);
}

#[test]
fn a_carver_that_is_switched_off_carves_nothing_and_keeps_its_maps() {
    let mut scene = scene();
    scene.settle();
    let whole = scene.headless.image();
    let carver = scene.carve(Sphere::new(6.0), ClipMesh::default(), at(4.0));
    scene.settle();
    scene.headless.frame();
    let (carved, maps) = (scene.headless.image(), scene.status().passes.jobs(SPAN_DEPTH));
    let set = |scene: &mut TestScene, is_active| {
        scene.world().get_mut::<ClipMesh>(carver).expect("a carver").is_active = is_active;
        scene.headless.frame();
    };
    set(&mut scene, false);
    assert!(scene.headless.image() == whole, "it carves while it is switched off");
    set(&mut scene, true);
    assert!(scene.headless.image() == carved && carved != whole, "it carves again in the same frame");
    scene.headless.frame();
    assert_eq!(scene.status().passes.jobs(SPAN_DEPTH), maps, "its maps were made again");
}
