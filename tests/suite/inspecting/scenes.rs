//! Scenes that Bevy writes hold all settings and nothing derived, and show the same when they are read.

use bevy::{
    asset::{AssetPath, uuid_handle},
    camera::visibility::VisibilityClass,
    ecs::{entity::EntityHashMap, reflect::AppTypeRegistry},
    light::NotShadowCaster,
    math::DVec3,
    prelude::*,
    world_serialization::serde::WorldDeserializer,
};
use bevy_contextual_ao::{
    occlusion::{GeometryTerm, OpacityModulation, SweepingSurface},
    prelude::*,
    volume::Intensities,
};
use contextual_ao_kit::headless::{Headless, different_pixels};
use serde::de::DeserializeSeed;
use std::path::PathBuf;

use super::is_ours;
use crate::{
    scene::{FEW_RAYS, IMAGE, folded_volume, is_empty, opaque_ramp},
    small_files::{Scratch, nrrd},
};

const BALL: Handle<Mesh> = uuid_handle!("6c1a6d5e-6f9f-4e55-8f0c-0d2a9a1f5c11");
const SIZE: UVec3 = UVec3::new(26, 24, 22);

/// The volume and its transfer function as files.
fn files(scratch: &Scratch) -> [PathBuf; 2] {
    let Intensities::U8(values) = folded_volume(SIZE, DVec3::ONE).intensities().clone() else {
        panic!("bytes");
    };
    let header = format!("sizes: {} {} {}\nspacings: 1 1 1\n", SIZE.x, SIZE.y, SIZE.z);
    [
        scratch.write("a.nrrd", &nrrd(&header, &values)),
        scratch.write("a.tf.ron", opaque_ramp().to_ron().expect("RON").as_bytes()),
    ]
}

/// An app with a camera.
fn app() -> Headless {
    let mut headless = Headless::new(IMAGE, |_| {});
    let (camera, world) = (headless.camera(), headless.app.world_mut());
    let near = Projection::Perspective(PerspectiveProjection { near: 1e-4, ..default() });
    world.spawn((camera, near, Transform::from_xyz(0.03, 0.02, 0.06).looking_at(Vec3::ZERO, Vec3::Y)));
    let ball = Sphere::new(0.006).into();
    world.resource_mut::<Assets<Mesh>>().insert(&BALL, ball).expect("room for it");
    headless
}

/// Entities of a scene: the volume, another volume, a carver of the first alone that is its child, a marked camera.
fn spawn(headless: &mut Headless, files: &[PathBuf; 2], occlusion: AmbientOcclusion) -> [Entity; 4] {
    let server = headless.app.world().resource::<AssetServer>().clone();
    let [volume, function] = files.clone().map(AssetPath::from_path_buf);
    let (volume, function) = (Volume3d(server.load(volume)), VolumeTransferFunction(server.load(function)));
    let shading = VolumeShading {
        lighting: VolumeLighting::Headlight,
        perceptual_roughness: 0.3,
        reflectance: 0.7,
        ambient_scale: AmbientScale::Published,
        occlusion_intensity: 1.2,
        exposure: 1.1,
        step_voxels: 0.4,
        reconstruction: Reconstruction::Trilinear,
        jitter: false,
        outline_rays: 6,
        ..default()
    };
    let quality = MotionQuality { lowest: Quality::Reference, target_frame_ms: 30.0, settle_s: 0.1 };
    let world = headless.app.world_mut();
    let first = world
        .spawn((
            (volume.clone(), function, occlusion, shading, quality),
            (NotShadowCaster, Pickable::IGNORE, ShowVolumeGizmos { color: Some(Color::BLACK) }),
            Transform::from_rotation(Quat::from_rotation_y(0.3)),
        ))
        .id();
    let second = world.spawn((volume, Transform::from_xyz(0.02, 0.0, -0.03))).id();
    let targets = ClipTargets::Only(vec![first]);
    let clip_mesh = ClipMesh { targets, ..ClipMesh::intersect() };
    let carver =
        world.spawn((clip_mesh, Mesh3d(BALL), Transform::from_xyz(0.004, 0.003, 0.004), ChildOf(first))).id();
    let camera = world.spawn(VolumePickingCamera).id();
    for volume in [first, second] {
        headless.until_ready(volume).expect("it can be shown");
    }
    [first, second, carver, camera]
}

/// What is written of entities of an app, with the text.
fn write(headless: &Headless, entities: &[Entity]) -> (DynamicWorld, String) {
    let world = headless.app.world();
    let registry = world.resource::<AppTypeRegistry>().read();
    let scene = DynamicWorldBuilder::from_world(world, &registry)
        // Bevy 0.19.1 cannot write it, and adds it again with the mesh.
        .deny_component::<VisibilityClass>()
        .deny_all_resources()
        .allow_resource::<ClipSettings>()
        .allow_resource::<CastBudget>()
        .extract_entities(entities.iter().copied())
        .extract_resources()
        .build();
    let text = scene.serialize(&registry).expect("it can be written");
    (scene, text)
}

/// Reads a scene into another app. Returns the entities that stand for the old ones.
fn read(headless: &mut Headless, text: &str) -> EntityHashMap<Entity> {
    let world = headless.app.world_mut();
    let registry = world.resource::<AppTypeRegistry>().clone();
    let mut server = world.resource::<AssetServer>().clone();
    let scene = {
        let registry = registry.read();
        let seed = WorldDeserializer { type_registry: &registry, load_from_path: &mut server };
        let mut deserializer = ron::Deserializer::from_str(text).expect("RON");
        seed.deserialize(&mut deserializer).expect("it can be read")
    };
    let mut entities = EntityHashMap::default();
    scene.write_to_world(world, &mut entities).expect("it can be spawned");
    entities
}

/// Names of our types among some.
fn names(registry: &AppTypeRegistry, values: &[Box<dyn PartialReflect>]) -> Vec<&'static str> {
    let registry = registry.read();
    let infos = values.iter().filter_map(|value| value.get_represented_type_info());
    let ours = infos.filter(|info| registry.get(info.type_id()).is_some_and(is_ours));
    let mut names: Vec<_> = ours.map(|info| info.type_path_table().ident().expect("a name")).collect();
    names.sort_unstable();
    names
}

#[test]
fn a_scene_holds_settings_and_targets_and_shows_the_same_when_read() {
    let scratch = Scratch::new("scene");
    let occlusion = AmbientOcclusion {
        sky: Sky::above(Vec3::Y),
        opacities: VoxelOpacities::OfCenters,
        ..AmbientOcclusion::by(OcclusionRays { steps: 4, ..FEW_RAYS })
    };
    let mut old = app();
    *old.app.world_mut().resource_mut::<ClipSettings>() =
        ClipSettings { depth_map_size: 256, max_layers: 3, coverage: CoverageRule::Points };
    *old.app.world_mut().resource_mut::<CastBudget>() = CastBudget { words_per_dispatch: 512, ..default() };
    let entities = spawn(&mut old, &files(&scratch), occlusion);
    old.frames(2);
    let expected = old.image();
    assert!(!is_empty(&expected));

    let (scene, text) = write(&old, &entities);
    let registry = old.app.world().resource::<AppTypeRegistry>().clone();
    let of = |entity: Entity| {
        let found = scene.entities.iter().find(|found| found.entity == entity);
        names(&registry, &found.expect("an entity").components)
    };
    let [first, second, carver, camera] = entities;
    let required = ["AmbientOcclusion", "Volume3d", "VolumeShading", "VolumeTransferFunction"];
    let mut all = ["MotionQuality", "ShowVolumeGizmos"].into_iter().chain(required).collect::<Vec<_>>();
    all.sort_unstable();
    assert_eq!(of(first), all);
    assert_eq!(of(second), required);
    assert_eq!(of(carver), ["ClipMesh"]);
    assert_eq!(of(camera), ["VolumePickingCamera"]);
    assert_eq!(names(&registry, &scene.resources), ["CastBudget", "ClipSettings"]);

    let mut new = app();
    let map = read(&mut new, &text);
    let [new_first, new_second, new_carver, _] = entities.map(|entity| map[&entity]);
    for volume in [new_first, new_second] {
        new.until_ready(volume).expect("it can be shown");
    }
    new.frames(2);
    assert_eq!(different_pixels(&new.image(), &expected), 0);
    let world = new.app.world();
    let targets = &world.get::<ClipMesh>(new_carver).expect("a carver").targets;
    assert_eq!(*targets, ClipTargets::Only(vec![new_first]));
    fn same<C: Component + PartialEq + core::fmt::Debug>(old: (&World, Entity), new: (&World, Entity)) {
        let [old, new] = [old, new].map(|(world, entity)| world.get::<C>(entity));
        assert!(old.is_some() && old == new, "{old:?} and {new:?}");
    }
    let (old, new) = ((old.app.world(), first), (world, new_first));
    same::<AmbientOcclusion>(old, new);
    same::<VolumeShading>(old, new);
    same::<MotionQuality>(old, new);
    same::<ShowVolumeGizmos>(old, new);
    same::<Pickable>(old, new);
    assert!(world.get::<NotShadowCaster>(new_first).is_some());
    assert_eq!(world.resource::<ClipSettings>(), old.0.resource::<ClipSettings>());
    assert_eq!(world.resource::<CastBudget>(), old.0.resource::<CastBudget>());
    // Written again, it is the same but for the numbers of entities.
    assert!(text.contains("a.nrrd") && text.contains("a.tf.ron"));
}

#[test]
fn whole_volumes_can_be_written_and_read_again_and_again() {
    let scratch = Scratch::new("again");
    let mut headless = app();
    let [mut volume, ..] = spawn(&mut headless, &files(&scratch), AmbientOcclusion::by(FEW_RAYS));
    headless.frames(2);
    let count = |headless: &mut Headless| {
        headless.app.world_mut().query::<&Transform>().iter(headless.app.world()).count()
    };
    let before = count(&mut headless);
    for _ in 0..3 {
        // All descendants, as an editor saves them.
        let world = headless.app.world();
        let children = world.get::<Children>(volume).into_iter().flat_map(|children| children.iter());
        let all: Vec<_> = [volume].into_iter().chain(children).collect();
        let (_, text) = write(&headless, &all);
        headless.app.world_mut().despawn(volume);
        headless.frames(2);
        volume = read(&mut headless, &text)[&volume];
        headless.until_ready(volume).expect("it can be shown");
        headless.frames(2);
        assert!(!is_empty(&headless.image()));
        assert_eq!(count(&mut headless), before, "entities of the crate pile up");
    }
    headless.app.world_mut().despawn(volume);
    headless.frames(2);
}

#[test]
fn every_method_is_written_with_its_settings() {
    let step_mm = Some(0.8);
    let rays = OcclusionRays {
        pattern: RayPattern::Fibonacci(9),
        steps: 3,
        step_mm,
        resolution: OcclusionResolution::Half,
    };
    let methods: Vec<OcclusionMethod> = vec![
        rays.into(),
        ProgressiveRays { rays, rays_per_frame: 3, kept_on_change: 0.25 }.into(),
        OcclusionSweeping {
            surface: SweepingSurface::Isosurface(99.0),
            geometry_term: GeometryTerm::BothSides,
            opacity: 0.4,
            gamma: 1.5,
            light: Some(Vec3::new(1.0, 2.0, 3.0)),
        }
        .into(),
        OcclusionFiltering {
            radius_mm: Some(3.0),
            brightness: 0.7,
            modulation: OpacityModulation::Variance(0.1),
            ..default()
        }
        .into(),
        SummedAreaOcclusion { radius_mm: Some(4.0), shells: 3 }.into(),
        ScreenSpaceOcclusion { radius_mm: Some(5.0), samples: 17, ..default() }.into(),
        DirectionalOcclusion { aperture_degrees: 33.0, samples: 5, ..default() }.into(),
    ];
    assert_eq!(methods.len(), OcclusionMethod::all().len());
    let mut headless = Headless::new(IMAGE, |_| {});
    for method in methods {
        let occlusion = AmbientOcclusion { recompute: Recompute::Everything, ..AmbientOcclusion::by(method) };
        let entity = headless.app.world_mut().spawn(occlusion.clone()).id();
        let (_, text) = write(&headless, &[entity]);
        let new = read(&mut headless, &text)[&entity];
        assert_ne!(new, entity);
        assert_eq!(headless.app.world().get::<AmbientOcclusion>(new), Some(&occlusion));
    }
}
