//! A volume that nobody sees costs nothing. The first frame in which it is seen is right.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::mode::ShadingMode;

use crate::scene::{
    FEW_RAYS, TestScene, few_rays, folded_volume, methods_of_few_rays, opaque_ramp, progressive_rays,
};
use contextual_ao_kit::headless::different_pixels;

/// Ways for a volume to be unseen, and to be seen again.
const WAYS: [(&str, fn(&mut TestScene, bool)); 3] = [
    ("hidden", |scene, is_seen| {
        let volume = scene.volume;
        let visibility = if is_seen { Visibility::Inherited } else { Visibility::Hidden };
        scene.world().entity_mut(volume).insert(visibility);
    }),
    ("camera off", |scene, is_seen| {
        let camera = scene.camera();
        scene.world().get_mut::<Camera>(camera).expect("a camera").is_active = is_seen;
    }),
    ("camera turned away", |scene, is_seen| {
        let camera = scene.camera();
        let place = scene.world().get::<Transform>(camera).expect("a camera").translation;
        let target = if is_seen { Vec3::ZERO } else { 2.0 * place };
        let view = Transform::from_translation(place).looking_at(target, Vec3::Y);
        scene.world().entity_mut(camera).insert(view);
    }),
];

fn at(step: u32) -> Transform {
    Transform::from_xyz(4.0 - 0.5 * step as f32, 3.0, 4.0)
}

fn carved(occlusion: &AmbientOcclusion, mode: ShadingMode) -> (TestScene, Entity) {
    let volume = folded_volume(UVec3::new(22, 20, 18), DVec3::ONE);
    let mut scene = TestScene::new(volume, opaque_ramp(), occlusion.clone(), mode);
    let carver = scene.carve(Sphere::new(6.0), ClipMesh::default(), at(0));
    scene.settle();
    scene.headless.frame();
    (scene, carver)
}

fn check(occlusion: AmbientOcclusion, mode: ShadingMode) {
    let name = format!("{} {}", occlusion.method.name(), mode.name());
    // Progressive rays need several frames.
    let frames = if matches!(occlusion.method, OcclusionMethod::Progressive(_)) { 11 } else { 1 };
    let (mut fresh, carver) = carved(&occlusion, mode);
    fresh.move_carver(carver, at(5));
    fresh.headless.frames(frames);
    let (mut scene, carver) = carved(&occlusion, mode);
    for (way, set_seen) in WAYS {
        scene.move_carver(carver, at(0));
        scene.headless.frame();
        set_seen(&mut scene, false);
        scene.headless.frames(2);
        let before = scene.status().passes;
        for step in 1..=5 {
            scene.move_carver(carver, at(step));
            scene.headless.frame();
        }
        scene.headless.frame();
        assert_eq!(scene.status().passes, before, "{name}, {way}: computed for nobody");
        set_seen(&mut scene, true);
        scene.headless.frames(frames);
        let wrong = different_pixels(&scene.headless.image(), &fresh.headless.image());
        assert_eq!(wrong, 0, "{name}, {way}: wrong when it is seen");
    }
}

#[test]
fn unseen_volumes_cost_nothing_and_come_back_right() {
    for method in methods_of_few_rays() {
        check(AmbientOcclusion::by(method), ShadingMode::Cao);
    }
    check(few_rays(), ShadingMode::Lao);
}

#[test]
fn settings_that_change_and_change_back_unseen_leave_no_trace() {
    let (mut scene, _) = carved(&few_rays(), ShadingMode::Cao);
    let before = scene.headless.image();
    let (hide, volume) = (WAYS[0].1, scene.volume);
    hide(&mut scene, false);
    scene.headless.frames(2);
    for resolution in [OcclusionResolution::Half, OcclusionResolution::Full] {
        scene
            .world()
            .entity_mut(volume)
            .insert(AmbientOcclusion::by(OcclusionRays { resolution, ..FEW_RAYS }));
        scene.headless.frames(2);
    }
    hide(&mut scene, true);
    scene.headless.frame();
    assert_eq!(different_pixels(&scene.headless.image(), &before), 0);
}

#[test]
fn progressive_rays_that_were_others_unseen_begin_anew() {
    let progressive = AmbientOcclusion::by(progressive_rays());
    let (mut scene, carver) = carved(&progressive, ShadingMode::Cao);
    let (hide, volume) = (WAYS[0].1, scene.volume);
    // Only some of the rays have been cast when the volume is hidden.
    scene.move_carver(carver, at(3));
    scene.headless.frames(3);
    hide(&mut scene, false);
    scene.headless.frames(2);
    for method in [FEW_RAYS.into(), progressive_rays()] {
        scene.world().get_mut::<AmbientOcclusion>(volume).expect("occlusion").method = method;
        scene.headless.frames(2);
    }
    hide(&mut scene, true);
    scene.headless.frames(14);
    let (mut fresh, carver) = carved(&progressive, ShadingMode::Cao);
    fresh.move_carver(carver, at(3));
    fresh.headless.frames(14);
    assert_eq!(different_pixels(&scene.headless.image(), &fresh.headless.image()), 0);
}
