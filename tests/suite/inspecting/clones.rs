//! Clones keep settings and targets, and get derived parts of their own.

use bevy::{light::NotShadowCaster, math::DVec3, prelude::*};
use bevy_contextual_ao::{clip::ClipCamera, prelude::*};
use contextual_ao_kit::{headless::different_pixels, mode::ShadingMode};

use crate::scene::{FEW_RAYS, TestScene, folded_volume, is_empty, opaque_ramp};

/// Settings other than the defaults.
fn settings() -> impl Bundle {
    let occlusion = AmbientOcclusion {
        sky: Sky::above(Vec3::Y),
        opacities: VoxelOpacities::OfCenters,
        ..AmbientOcclusion::by(OcclusionRays { steps: 4, ..FEW_RAYS })
    };
    let shading = VolumeShading { exposure: 0.9, occlusion_intensity: 1.3, jitter: false, ..default() };
    let quality = MotionQuality { settle_s: 0.0, ..default() };
    (occlusion, shading, quality, NotShadowCaster, ShowVolumeGizmos::default())
}

fn scene() -> TestScene {
    let volume = folded_volume(UVec3::new(26, 24, 22), DVec3::ONE);
    let occlusion = AmbientOcclusion::by(FEW_RAYS);
    let mut scene = TestScene::new(volume, opaque_ramp(), occlusion, ShadingMode::Cao);
    let mut store = scene.world().resource_mut::<GizmoConfigStore>();
    // The gizmos would hide differences.
    store.config_mut::<VolumeGizmoConfigGroup>().0.enabled = false;
    let volume = scene.volume;
    scene.world().entity_mut(volume).insert(settings());
    scene
}

/// Number of entities that draw a volume's box.
fn boxes(scene: &mut TestScene) -> usize {
    let world = scene.world();
    world.query::<&Name>().iter(world).filter(|name| name.as_str() == "volume box").count()
}

fn image(scene: &mut TestScene) -> Vec<u8> {
    scene.headless.frames(3);
    let image = scene.headless.image();
    assert!(!is_empty(&image));
    image
}

fn assert_same_settings(scene: &mut TestScene, a: Entity, b: Entity) {
    fn same<C: Component + PartialEq + core::fmt::Debug>(world: &World, a: Entity, b: Entity) {
        let of = |entity| world.get::<C>(entity);
        assert!(of(a).is_some() && of(a) == of(b), "{:?} and {:?}", of(a), of(b));
    }
    let world = &*scene.world();
    same::<Volume3d>(world, a, b);
    same::<VolumeTransferFunction>(world, a, b);
    same::<AmbientOcclusion>(world, a, b);
    same::<VolumeShading>(world, a, b);
    same::<MotionQuality>(world, a, b);
    same::<ShowVolumeGizmos>(world, a, b);
    assert!(world.get::<NotShadowCaster>(b).is_some());
}

#[test]
fn a_clone_of_a_volume_is_drawn_as_the_original_and_by_itself() {
    let mut scene = scene();
    scene.carve(Sphere::new(6.0), ClipMesh::default(), Transform::from_xyz(4.0, 3.0, 4.0));
    scene.settle();
    let alone = image(&mut scene);
    let original = scene.volume;
    let copy = scene.world().entity_mut(original).clone_and_spawn();
    scene.headless.frames(2);
    assert_same_settings(&mut scene, original, copy);
    assert_eq!(boxes(&mut scene), 2);
    // Each goes by itself.
    scene.world().despawn(original);
    scene.headless.frames(2);
    assert_eq!(boxes(&mut scene), 1);
    assert_eq!(different_pixels(&image(&mut scene), &alone), 0);
    let second = scene.world().entity_mut(copy).clone_and_spawn();
    scene.headless.frames(2);
    scene.world().despawn(second);
    scene.headless.frames(2);
    assert_eq!(boxes(&mut scene), 1);
    assert_eq!(different_pixels(&image(&mut scene), &alone), 0);
    // A volume that is removed from the clone leaves the original alone.
    let third = scene.world().entity_mut(copy).clone_and_spawn();
    scene.world().entity_mut(third).remove::<Volume3d>();
    scene.headless.frames(2);
    assert_eq!(boxes(&mut scene), 1);
    assert_eq!(different_pixels(&image(&mut scene), &alone), 0);
}

#[test]
fn a_clone_of_a_carver_carves_as_the_original() {
    let mut scene = scene();
    let volume = scene.volume;
    let elsewhere = scene.world().spawn_empty().id();
    let clip_mesh = ClipMesh { targets: ClipTargets::Only(vec![volume, elsewhere]), ..default() };
    let place = Transform::from_xyz(4.0, 3.0, 4.0);
    let original = scene.carve(Sphere::new(6.0), clip_mesh.clone(), place);
    scene.settle();
    let carved = image(&mut scene);
    let copy = scene.world().entity_mut(original).clone_and_spawn();
    scene.headless.frames(2);
    assert_eq!(scene.world().get::<ClipMesh>(copy), Some(&clip_mesh));
    assert!(scene.world().get::<ClipCamera>(copy).is_some());
    // Where two carvers cut a voxel, its coverage is taken by points: the picture is that of two.
    scene.world().despawn(original);
    assert_eq!(different_pixels(&image(&mut scene), &carved), 0);
    // It moves and changes by itself.
    scene.move_carver(copy, Transform::from_xyz(-4.0, 3.0, 4.0));
    assert!(different_pixels(&image(&mut scene), &carved) > 100);
    scene.move_carver(copy, place);
    assert_eq!(different_pixels(&image(&mut scene), &carved), 0);
}

#[test]
fn a_clone_of_a_hierarchy_keeps_to_itself() {
    let mut scene = scene();
    let volume = scene.volume;
    let targets = ClipTargets::Only(vec![volume]);
    let clip_mesh = ClipMesh { targets, ..default() };
    let carver = scene.carve(Sphere::new(6.0), clip_mesh, Transform::from_xyz(4.0, 3.0, 4.0));
    let root = scene.world().spawn((Transform::default(), Visibility::default())).id();
    scene.world().entity_mut(root).add_children(&[volume, carver]);
    scene.settle();
    let alone = image(&mut scene);
    let copy = scene.world().entity_mut(root).clone_and_spawn_with_opt_out(|builder| {
        builder.linked_cloning(true);
    });
    scene.headless.frames(2);
    assert_eq!(boxes(&mut scene), 2);
    let world = scene.world();
    let children: Vec<_> = world.get::<Children>(copy).expect("children").iter().collect();
    let with = |is: fn(&World, Entity) -> bool| {
        children.iter().copied().find(|child| is(world, *child)).expect("a clone of each")
    };
    let new_volume = with(|world, child| world.get::<Volume3d>(child).is_some());
    let new_carver = with(|world, child| world.get::<ClipMesh>(child).is_some());
    let new_targets = &scene.world().get::<ClipMesh>(new_carver).expect("a carver").targets;
    assert_eq!(*new_targets, ClipTargets::Only(vec![new_volume]));
    assert_same_settings(&mut scene, volume, new_volume);
    scene.world().despawn(root);
    assert_eq!(different_pixels(&image(&mut scene), &alone), 0);
    assert_eq!(boxes(&mut scene), 1);
    scene.world().despawn(copy);
    scene.headless.frames(2);
    assert_eq!(boxes(&mut scene), 0);
    assert!(is_empty(&scene.headless.image()));
}
