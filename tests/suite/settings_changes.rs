//! Images while settings are switched. Every frame is drawn, none is empty, and the old image stays until the new one
//! is there.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{
    occlusion::{GeometryTerm, OpacityModulation, SweepingSurface},
    prelude::*,
};
use contextual_ao_kit::mode::ShadingMode;
use std::time::{Duration, Instant};

use crate::scene::{
    FEW_RAYS, IMAGE, TestScene, few_rays, folded_volume, is_empty, opaque_ramp, translucent_ramp,
};
use contextual_ao_kit::headless::{Headless, different_pixels};

const SIZE: UVec3 = UVec3::new(26, 24, 22);

fn scene() -> TestScene {
    let mut scene =
        TestScene::new(folded_volume(SIZE, DVec3::ONE), opaque_ramp(), few_rays(), ShadingMode::Cao);
    scene.carve(Sphere::new(6.0), ClipMesh::default(), Transform::from_xyz(4.0, 3.0, 4.0));
    scene.settle();
    // Passes that ran are reported a frame later.
    scene.headless.frame();
    scene
}

/// The images of the next frames.
fn next_images(scene: &mut TestScene, frames: u32) -> Vec<Vec<u8>> {
    let image = |_| {
        scene.headless.frame();
        scene.headless.image()
    };
    (0..frames).map(image).collect()
}

#[test]
fn no_change_of_settings_shows_an_empty_frame() {
    let half = AmbientOcclusion::by(OcclusionRays { resolution: OcclusionResolution::Half, ..FEW_RAYS });
    let sweep = |geometry_term| AmbientOcclusion::by(OcclusionSweeping { geometry_term, ..default() });
    let filter = |modulation| AmbientOcclusion::by(OcclusionFiltering { modulation, ..default() });
    let settings = [
        ("full", few_rays()),
        ("half", half.clone()),
        ("full again", few_rays()),
        ("sweeping", sweep(GeometryTerm::None)),
        ("its geometry term", sweep(GeometryTerm::Cosine)),
        ("without", sweep(GeometryTerm::None)),
        ("filtering", filter(OpacityModulation::None)),
        ("its modulation", filter(OpacityModulation::Variance(0.05))),
        ("summed area", AmbientOcclusion::by(SummedAreaOcclusion::default())),
        ("its mean", AmbientOcclusion::by(SummedAreaOcclusion { shells: 1, ..default() })),
        ("half from there", half),
        ("sweeping from there", sweep(GeometryTerm::BothSides)),
        ("rays from there", few_rays()),
    ];
    let mut scene = scene();
    let volume = scene.volume;
    for (name, occlusion) in settings {
        scene.world().entity_mut(volume).insert(occlusion);
        let images = next_images(&mut scene, 3);
        for (frame, image) in images.iter().enumerate() {
            assert!(!is_empty(image), "{name}: frame {frame} is empty");
            assert_eq!(different_pixels(image, &images[2]), 0, "{name}: frame {frame} is not final");
        }
    }
}

#[test]
fn while_shaders_are_compiled_volumes_are_drawn_as_before() {
    let volume = || folded_volume(SIZE, DVec3::ONE);
    let surface = SweepingSurface::Isosurface(130.0);
    let sweeping = OcclusionSweeping { surface, geometry_term: GeometryTerm::Cosine, ..default() };
    let filtering = OcclusionFiltering { modulation: OpacityModulation::Variance(0.05), ..default() };
    let settings = [
        AmbientOcclusion::by(sweeping),
        AmbientOcclusion::by(filtering),
        AmbientOcclusion::by(SummedAreaOcclusion::default()),
        AmbientOcclusion::by(OcclusionMethod::ScreenSpace(default())),
        AmbientOcclusion::by(OcclusionMethod::Directional(default())),
        few_rays(),
    ];
    let headless = Headless::compiling_in_background(IMAGE, |_| {});
    let mut scene = TestScene::in_app(headless, volume(), opaque_ramp(), few_rays(), ShadingMode::Cao);
    assert!(scene.headless.frames_until(|headless| !is_empty(&headless.image())));
    scene.settle();
    let mut shown = scene.headless.image();
    for occlusion in settings {
        let mut expected = TestScene::new(volume(), opaque_ramp(), occlusion.clone(), ShadingMode::Cao);
        expected.settle();
        let expected = expected.headless.image();
        let volume = scene.volume;
        let name = occlusion.method.name();
        scene.world().entity_mut(volume).insert(occlusion);
        let begin = Instant::now();
        loop {
            scene.headless.frame();
            let image = scene.headless.image();
            if image == expected {
                break;
            }
            let different = different_pixels(&image, &shown);
            assert_eq!(
                different,
                0,
                "{name}: neither as before nor as it is to be after {:?}",
                begin.elapsed()
            );
            assert!(begin.elapsed() < Duration::from_secs(60), "{name}: never as it is to be");
        }
        shown = expected;
    }
}

#[test]
fn a_volume_that_is_there_is_drawn_in_the_frame_in_which_it_comes() {
    let mut scene = scene();
    let before = scene.headless.image();
    let volume = scene.volume;
    let world = scene.world();
    let bundle = (
        world.get::<Volume3d>(volume).expect("a volume").clone(),
        world.get::<VolumeTransferFunction>(volume).expect("a function").clone(),
        world.get::<VolumeShading>(volume).expect("shading").clone(),
        few_rays(),
    );
    world.despawn(volume);
    let second = world.spawn(bundle).id();
    let images = next_images(&mut scene, 3);
    for (frame, image) in images.iter().enumerate() {
        assert_eq!(different_pixels(image, &before), 0, "frame {frame}");
    }
    // Data that two entities share is on the device once.
    let one = scene.status().usage;
    let world = scene.world();
    let data = world.get::<Volume3d>(second).expect("a volume").clone();
    world.spawn((data, Transform::from_xyz(9.0, 0.0, 0.0)));
    scene.headless.frames(2);
    assert_eq!(scene.status().usage.textures, one.textures + 5);
}

#[test]
fn the_old_transfer_function_stays_until_the_new_one_is_there() {
    let mut scene = scene();
    let before = scene.headless.image();
    let passes = scene.status().passes;
    let volume = scene.volume;
    let new = scene.world().resource::<Assets<TransferFunction>>().reserve_handle();
    scene.world().entity_mut(volume).insert(VolumeTransferFunction(new.clone()));
    for image in next_images(&mut scene, 4) {
        assert_eq!(different_pixels(&image, &before), 0, "changed before it is there");
    }
    assert_eq!(scene.status().passes, passes, "computed anew for nothing");
    let _ = scene.world().resource_mut::<Assets<TransferFunction>>().insert(&new, translucent_ramp());
    let images = next_images(&mut scene, 3);
    assert!(different_pixels(&images[0], &before) > 500, "not shown when it is there");
    assert_eq!(different_pixels(&images[0], &images[2]), 0, "not final when it is there");
}

#[test]
fn the_old_volume_stays_until_the_new_one_and_its_transfer_function_are_there() {
    let other = || folded_volume(UVec3::new(19, 30, 17), DVec3::new(1.2, 0.8, 1.1));
    let mut scene = scene();
    let before = scene.headless.image();
    let volume = scene.volume;
    let world = scene.world();
    let data = world.resource::<Assets<Volume>>().reserve_handle();
    let function = world.resource::<Assets<TransferFunction>>().reserve_handle();
    world.entity_mut(volume).insert((Volume3d(data.clone()), VolumeTransferFunction(function.clone())));
    for image in next_images(&mut scene, 3) {
        assert_eq!(different_pixels(&image, &before), 0, "changed before anything is there");
    }
    let _ = scene.world().resource_mut::<Assets<Volume>>().insert(&data, other());
    for image in next_images(&mut scene, 3) {
        assert_eq!(different_pixels(&image, &before), 0, "changed before the transfer function is there");
    }
    let _ = scene.world().resource_mut::<Assets<TransferFunction>>().insert(&function, translucent_ramp());
    let images = next_images(&mut scene, 3);
    assert!(images.iter().all(|image| !is_empty(image)));
    assert!(different_pixels(&images[0], &before) > 500, "not shown when both are there");
    assert_eq!(different_pixels(&images[0], &images[2]), 0, "not final when both are there");
}
