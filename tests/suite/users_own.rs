//! The crate leaves the user's entities, meshes, transforms, cameras and pointers alone.

use bevy::{
    camera::visibility::RenderLayers,
    core_pipeline::prepass::DepthPrepass,
    ecs::system::RunSystemOnce,
    math::DVec3,
    picking::mesh_picking::ray_cast::{MeshRayCast, MeshRayCastSettings},
    prelude::*,
};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::mode::ShadingMode;

use crate::scene::{TestScene, few_rays, folded_volume, is_empty, opaque_ramp};
use contextual_ao_kit::headless::different_pixels;

fn scene() -> TestScene {
    let volume = folded_volume(UVec3::new(26, 24, 22), DVec3::ONE);
    let mut scene = TestScene::new(volume, opaque_ramp(), few_rays(), ShadingMode::Cao);
    scene.settle();
    scene
}

#[test]
fn a_transform_of_scale_one_shows_a_volume_at_its_size() {
    let place = Transform::from_xyz(0.004, 0.002, -0.003).with_rotation(Quat::from_rotation_y(0.4));
    let mut bundle = scene();
    let volume = bundle.volume;
    let data = bundle.world().get::<Volume3d>(volume).expect("a volume").clone();
    let function = bundle.world().get::<VolumeTransferFunction>(volume).expect("a function").clone();
    bundle.world().entity_mut(volume).insert((place, VolumeShading::default()));
    bundle.headless.frames(2);
    let expected = bundle.headless.image();
    assert!(!is_empty(&expected));
    bundle.world().despawn(volume);
    bundle.world().spawn((data, function, few_rays(), place));
    bundle.headless.frames(2);
    assert_eq!(different_pixels(&bundle.headless.image(), &expected), 0);
}

#[test]
fn the_volumes_entity_keeps_its_own_mesh_and_gets_no_other() {
    let mut scene = scene();
    let volume = scene.volume;
    assert!(scene.world().get::<Mesh3d>(volume).is_none());
    let mesh = scene.world().resource_mut::<Assets<Mesh>>().add(Cuboid::default());
    scene.world().entity_mut(volume).insert(Mesh3d(mesh.clone()));
    scene.headless.frames(2);
    let image = scene.headless.image();
    // Despawning the children also despawns the box. The box comes again.
    scene.world().entity_mut(volume).despawn_children();
    scene.headless.frames(2);
    assert_eq!(different_pixels(&scene.headless.image(), &image), 0, "the box stays away");
    scene.world().entity_mut(volume).remove::<Volume3d>();
    scene.headless.frames(2);
    assert_eq!(scene.world().get::<Mesh3d>(volume), Some(&Mesh3d(mesh)));
    assert!(scene.world().get::<Children>(volume).is_none(), "the box stays behind");
}

#[test]
fn pointers_pass_through_a_volumes_box() {
    let mut scene = scene();
    scene.headless.frames(2);
    let mesh = scene.world().resource_mut::<Assets<Mesh>>().add(Sphere::new(0.005));
    let behind = scene.world().spawn((Mesh3d(mesh), Transform::from_xyz(0.0, 0.0, -0.1))).id();
    scene.headless.frames(2);
    let ray = Ray3d::new(Vec3::new(0.0, 0.0, 0.2), Dir3::NEG_Z);
    let cast = move |mut meshes: MeshRayCast| -> Vec<Entity> {
        meshes.cast_ray(ray, &MeshRayCastSettings::default()).iter().map(|(entity, _)| *entity).collect()
    };
    assert_eq!(scene.world().run_system_once(cast).expect("it runs"), [behind]);
}

#[test]
fn only_cameras_that_can_see_a_volume_get_a_depth_prepass() {
    let mut scene = scene();
    let volume = scene.volume;
    let seeing = scene.camera();
    let world = scene.world();
    let other_layer = world.spawn((Camera3d::default(), RenderLayers::layer(3))).id();
    let inactive = world.spawn((Camera3d::default(), Camera { is_active: false, ..default() })).id();
    let users_own = world.spawn((Camera3d::default(), DepthPrepass)).id();
    let with_prepass = |scene: &mut TestScene| {
        [seeing, other_layer, inactive, users_own]
            .map(|camera| scene.world().get::<DepthPrepass>(camera).is_some())
    };
    scene.headless.frame();
    assert_eq!(with_prepass(&mut scene), [true, false, false, true]);
    // The volume's layers count, and are those of the box that draws it.
    scene.world().entity_mut(volume).insert(RenderLayers::layer(3));
    scene.headless.frame();
    assert_eq!(with_prepass(&mut scene), [false, true, false, true]);
    assert!(is_empty(&scene.headless.image()), "drawn in a layer that it is not in");
    scene.world().entity_mut(volume).remove::<RenderLayers>();
    scene.headless.frame();
    assert!(!is_empty(&scene.headless.image()));
    // A prepass that the user inserts in place of ours stays.
    scene.world().entity_mut(seeing).insert(DepthPrepass);
    scene.world().get_mut::<Camera>(inactive).expect("a camera").is_active = true;
    scene.headless.frame();
    assert_eq!(with_prepass(&mut scene), [true, false, true, true]);
    scene.world().despawn(volume);
    scene.headless.frame();
    assert_eq!(with_prepass(&mut scene), [true, false, false, true]);
}
