//! Quality presets, and fewer view samples while something moves.

use bevy::{camera::visibility::RenderLayers, math::DVec3, prelude::*, time::TimeUpdateStrategy};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::{chart::rms, headless::different_pixels, mode::ShadingMode};
use std::time::Duration;

use crate::scene::{TestScene, few_rays, folded_volume, translucent_ramp};

const SIZE: UVec3 = UVec3::new(26, 24, 22);
const FRAME_MS: u64 = 10;
/// Frames of motion after which any floor is reached.
const LONG: u32 = 20;
/// Settles in the fourth frame without motion.
const UNREACHABLE: MotionQuality =
    MotionQuality { lowest: Quality::Low, target_frame_ms: 0.001, settle_s: 0.035 };
/// View samples whose number can fall by a factor of 2 twice before the floor.
const FINE: Quality = Quality::High;

/// A scene whose frames take [`FRAME_MS`] by the clock.
fn scene() -> TestScene {
    let volume = folded_volume(SIZE, DVec3::ONE);
    let mut scene = TestScene::new(volume, translucent_ramp(), few_rays(), ShadingMode::Cao);
    let frame = TimeUpdateStrategy::ManualDuration(Duration::from_millis(FRAME_MS));
    scene.headless.app.insert_resource(frame);
    set_view_samples(&mut scene, FINE);
    scene.settle();
    scene
}

fn shading(scene: &mut TestScene) -> Mut<'_, VolumeShading> {
    let volume = scene.volume;
    scene.world().get_mut::<VolumeShading>(volume).expect("a volume")
}

fn set_view_samples(scene: &mut TestScene, quality: Quality) {
    let VolumeShading { step_voxels, jitter, .. } = quality.shading();
    let mut shading = shading(scene);
    (shading.step_voxels, shading.jitter) = (step_voxels, jitter);
}

fn adapt(scene: &mut TestScene, quality: MotionQuality) {
    let volume = scene.volume;
    scene.world().entity_mut(volume).insert(quality);
    scene.headless.frame();
}

/// Moves the carver to and fro for some frames. It ends at the same place for the same parity.
fn carve(scene: &mut TestScene, carver: Entity, frames: u32) {
    for frame in 0..frames {
        scene.move_carver(carver, Transform::from_xyz(4.0 + (frame % 2) as f32, 3.0, 4.0));
        scene.headless.frame();
    }
}

fn frame_image(scene: &mut TestScene) -> Vec<u8> {
    scene.headless.frame();
    scene.headless.image()
}

/// Image with a preset's view samples at rest. The frame after is as before.
fn image_with(scene: &mut TestScene, quality: Quality) -> Vec<u8> {
    let volume = scene.volume;
    let before = shading(scene).clone();
    let adapts = scene.world().entity_mut(volume).take::<MotionQuality>();
    set_view_samples(scene, quality);
    let image = frame_image(scene);
    *shading(scene) = before;
    if let Some(adapts) = adapts {
        scene.world().entity_mut(volume).insert(adapts);
    }
    scene.headless.frame();
    image
}

#[test]
fn each_preset_comes_closer_to_the_reference() {
    let volume = folded_volume(SIZE, DVec3::ONE);
    let mut scene = TestScene::new(volume, translucent_ramp(), default(), ShadingMode::Cao);
    scene.settle();
    let images = Quality::ALL.map(|quality| {
        let volume = scene.volume;
        let world = scene.world();
        let mut volume = world.entity_mut(volume);
        let (mut shading, mut occlusion) =
            volume.get_components_mut::<(&mut VolumeShading, &mut AmbientOcclusion)>().expect("a volume");
        quality.apply(&mut shading, &mut occlusion);
        scene.settle();
        frame_image(&mut scene)
    });
    let [.., reference] = &images;
    let error = |image: &Vec<u8>| {
        let differences = image.iter().zip(reference).map(|(a, b)| f64::from(*a) - f64::from(*b));
        rms(differences).0.expect("there are pixels")
    };
    let errors = images.each_ref().map(error);
    assert!(errors.windows(2).all(|pair| pair[0] > 1.2 * pair[1]), "{errors:?}");
    assert!(errors[0] < 12.0, "the fastest is another picture: {errors:?}");
}

#[test]
fn presets_leave_what_is_not_quality() {
    let sky = Sky::above(Vec3::Y);
    let rays = OcclusionRays { steps: 33, step_mm: Some(0.7), ..default() };
    for quality in Quality::ALL {
        let mut occlusion =
            AmbientOcclusion { sky, recompute: Recompute::Everything, ..AmbientOcclusion::by(rays) };
        let lighting = VolumeLighting::Headlight;
        let mut shading = VolumeShading { lighting, ambient_occlusion: false, ..default() };
        quality.apply(&mut shading, &mut occlusion);
        assert_eq!(Quality::of(&shading, &occlusion), Some(quality));
        let after = *occlusion.method.rays().expect("rays stay rays");
        assert_eq!((after.steps, after.step_mm), (33, Some(0.7)), "{quality}: the reach");
        assert_eq!((occlusion.sky, occlusion.recompute), (sky, Recompute::Everything), "{quality}");
        assert_eq!((shading.lighting, shading.ambient_occlusion), (lighting, false), "{quality}");
        shading.step_voxels *= 1.5;
        assert_eq!(Quality::of(&shading, &occlusion), None);
        assert_eq!(quality.to_string().parse(), Ok(quality));
    }
    let mut direct = AmbientOcclusion::by(DirectionalOcclusion::default());
    Quality::High.apply(&mut default(), &mut direct);
    assert_eq!(direct, AmbientOcclusion::by(DirectionalOcclusion::default()), "a method without rays stays");
    assert!("best".parse::<Quality>().is_err_and(|error| error.contains("reference")));
}

#[test]
fn a_bundle_has_the_preset_and_the_defaults_are_medium() {
    let bundle = VolumeBundle::new(default()).with_quality(Quality::Low);
    assert_eq!(bundle.occlusion.method.rays(), Some(&Quality::Low.rays()));
    assert_eq!(bundle.shading, Quality::Low.shading());
    let bundle = VolumeBundle::new(default());
    assert_eq!(Quality::of(&bundle.shading, &bundle.occlusion), Some(Quality::Medium));
    assert_eq!(Quality::default(), Quality::Medium);
}

#[test]
fn rays_of_every_preset_fit_a_software_driver() {
    // It ends an invocation after 65,535 rounds. Each of two invocations casts half of the rays.
    let rounds = Quality::ALL.map(|quality| quality.rays().pattern.rays() * (quality.rays().steps + 1) / 2);
    assert!(rounds.iter().all(|rounds| *rounds < 65_535), "{rounds:?}");
}

#[test]
fn motion_is_drawn_at_the_floor_and_rest_in_full() {
    let mut scene = scene();
    let carver = scene.carve(Sphere::new(6.0), ClipMesh::default(), Transform::from_xyz(4.0, 3.0, 4.0));
    scene.settle();
    carve(&mut scene, carver, 2);
    let [full, floor, coarsest] =
        [FINE, Quality::Medium, Quality::Low].map(|quality| image_with(&mut scene, quality));
    assert!(different_pixels(&full, &floor) > 50 && different_pixels(&floor, &coarsest) > 50);
    for (lowest, expected) in [(Quality::Medium, &floor), (Quality::Low, &coarsest), (FINE, &full)] {
        adapt(&mut scene, MotionQuality { lowest, ..UNREACHABLE });
        carve(&mut scene, carver, LONG);
        assert_eq!(different_pixels(&scene.headless.image(), expected), 0, "{lowest} in motion");
        for frame in 1..=3 {
            assert_eq!(different_pixels(&frame_image(&mut scene), expected), 0, "{lowest} settles: {frame}");
        }
        assert_eq!(different_pixels(&frame_image(&mut scene), &full), 0, "{lowest} at rest");
    }
    // Fast frames keep all samples.
    adapt(&mut scene, MotionQuality { target_frame_ms: 1e6, ..UNREACHABLE });
    carve(&mut scene, carver, LONG);
    assert_eq!(different_pixels(&scene.headless.image(), &full), 0, "in fast motion");
}

#[test]
fn removing_the_component_restores_the_volume_at_once() {
    let mut scene = scene();
    let volume = scene.volume;
    let carver = scene.carve(Sphere::new(6.0), ClipMesh::default(), Transform::from_xyz(4.0, 3.0, 4.0));
    scene.settle();
    carve(&mut scene, carver, LONG);
    let full = scene.headless.image();
    let own = shading(&mut scene).clone();
    let written = shading(&mut scene).last_changed();
    adapt(&mut scene, UNREACHABLE);
    carve(&mut scene, carver, LONG);
    assert!(different_pixels(&scene.headless.image(), &full) > 500, "it does not adapt");
    assert_eq!(*shading(&mut scene), own);
    assert_eq!(shading(&mut scene).last_changed(), written, "the user's own settings were written");
    scene.world().entity_mut(volume).remove::<MotionQuality>();
    assert_eq!(different_pixels(&frame_image(&mut scene), &full), 0);
    // Nothing of the past stays: the next motion begins in full.
    adapt(&mut scene, UNREACHABLE);
    carve(&mut scene, carver, 2);
    assert_eq!(different_pixels(&scene.headless.image(), &full), 0);
}

/// The parent of everything.
#[derive(Component)]
struct Rig;

fn turn(scene: &mut TestScene, entity: Entity, by: f32) {
    let mut place = scene.world().get_mut::<Transform>(entity).expect("a place");
    place.rotation = Quat::from_rotation_z(0.001 * by) * place.rotation;
}

#[test]
fn motion_is_what_changes_the_view() {
    type Change = fn(&mut TestScene, [Entity; 3], f32);
    let changes: [(&str, bool, Change); 8] = [
        ("nothing", false, |_, _, _| {}),
        ("the same values again", false, |scene, [carver, camera, _], _| {
            for entity in [carver, camera, scene.volume] {
                let mut entity = scene.world().entity_mut(entity);
                let place = *entity.get::<Transform>().expect("a place");
                entity.insert(place);
            }
        }),
        ("a carver of another volume", false, |scene, [_, _, other], by| {
            scene.move_carver(other, Transform::from_xyz(by, 0.0, 0.0));
        }),
        ("everything at once", false, |scene, _, by| {
            let mut rigs = scene.world().query_filtered::<&mut Transform, With<Rig>>();
            for mut rig in rigs.iter_mut(scene.headless.app.world_mut()) {
                rig.translation.x = 5.0 * by;
            }
        }),
        ("the camera", true, |scene, [_, camera, _], by| turn(scene, camera, by)),
        ("the volume", true, |scene, _, by| {
            let volume = scene.volume;
            turn(scene, volume, by);
        }),
        ("the carver", true, |scene, [carver, ..], by| turn(scene, carver, by)),
        ("the lens", true, |scene, [_, camera, _], by| {
            let lens = PerspectiveProjection { near: 1e-4, fov: 0.8 + 0.01 * by, ..default() };
            scene.world().entity_mut(camera).insert(Projection::Perspective(lens));
        }),
    ];
    let mut scene = scene();
    let carver = scene.carve(Sphere::new(6.0), ClipMesh::default(), Transform::from_xyz(4.0, 3.0, 4.0));
    let targets = ClipTargets::Only(vec![carver]);
    let other = scene.carve(Sphere::new(6.0), ClipMesh { targets, ..default() }, Transform::IDENTITY);
    let (camera, volume) = (scene.camera(), scene.volume);
    let rig = scene.world().spawn((Rig, Transform::IDENTITY, Visibility::default())).id();
    scene.world().entity_mut(rig).add_children(&[carver, camera, volume]);
    // A camera that does not see the volume moves all the time.
    let blind = scene.world().spawn((Camera3d::default(), RenderLayers::layer(7))).id();
    scene.settle();
    for (name, is_motion, change) in changes {
        adapt(&mut scene, UNREACHABLE);
        for frame in 0..LONG {
            turn(&mut scene, blind, 1.0);
            change(&mut scene, [carver, camera, other], (frame % 7) as f32);
            scene.headless.frame();
        }
        let adapted = scene.headless.image();
        scene.world().entity_mut(volume).remove::<MotionQuality>();
        let is_full = different_pixels(&adapted, &frame_image(&mut scene)) == 0;
        assert_eq!(is_full, !is_motion, "{name}");
    }
}
