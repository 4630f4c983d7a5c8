//! Each eye sees, to the bit, what one camera with its pose sees. Noise and dither do not differ between eyes.

use bevy::{
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    prelude::*,
    render::camera::TemporalJitter,
};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::mode::ShadingMode;

use crate::scene::methods_of_few_rays;

use super::rig::{Eye, Look, OPAQUE, OneCamera, TwoEyes, assert_same, eyes_of, head_from};

const TRANSLUCENT: Look = Look { is_translucent: true, mode: ShadingMode::Cao, ..OPAQUE };
const LIT: Look = Look { has_scene_lights: true, ..OPAQUE };
const DITHERED: Look =
    Look { tonemapping: Tonemapping::AcesFitted, deband: DebandDither::Enabled, ..TRANSLUCENT };

const LOOKS: [(&str, Look); 8] = [
    ("opaque", OPAQUE),
    ("opaque, no jitter", Look { jitter: false, ..OPAQUE }),
    ("opaque, Msaa", Look { msaa: Msaa::Sample4, ..OPAQUE }),
    ("translucent", TRANSLUCENT),
    ("translucent, no jitter, Msaa", Look { jitter: false, msaa: Msaa::Sample4, ..TRANSLUCENT }),
    ("scene lights", LIT),
    ("translucent, scene lights, Msaa", Look { is_translucent: true, msaa: Msaa::Sample4, ..LIT }),
    ("dithered", DITHERED),
];

/// A head that moves: its predicted pose, and that a little later.
fn heads(frame: u32) -> [Transform; 2] {
    [frame as f32, frame as f32 + 0.7].map(|time| {
        let head = head_from(Vec3::new((0.13 * time).sin(), 0.3, (0.13 * time).cos()));
        head * Transform::from_rotation(Quat::from_euler(
            EulerRot::YXZ,
            0.05 * (1.7 * time).sin(),
            0.02,
            0.04 * time,
        ))
    })
}

/// Eyes in the main world, and in the render world.
fn eyes(frame: u32) -> [[Eye; 2]; 2] {
    heads(frame).map(eyes_of)
}

#[test]
fn each_eye_sees_what_one_camera_sees() {
    let (mut two, mut one) = (TwoEyes::new(), OneCamera::new());
    let mut frame = 0;
    for (name, look) in LOOKS {
        two.set_look(look);
        one.set_look(look);
        for _ in 0..3 {
            frame += 1;
            let [early, late] = eyes(frame);
            two.carve(frame);
            let seen = two.draw(early, late);
            one.carve(frame);
            let expected = late.map(|eye| one.draw(eye));
            assert_same(&format!("{name}, frame {frame}"), &seen, &expected);
        }
    }
}

#[test]
fn each_eye_sees_what_one_camera_sees_by_every_method() {
    let (mut two, mut one) = (TwoEyes::new(), OneCamera::new());
    // Progressive rays depend on the frames before, and the camera draws two for each of the eyes.
    let methods = methods_of_few_rays().filter(|method| method.get::<ProgressiveRays>().is_none());
    for (frame, method) in (1..).zip(methods) {
        for scene in [&mut *two, &mut *one] {
            let volume = scene.scene.volume;
            scene.scene.world().entity_mut(volume).insert(AmbientOcclusion::by(method.clone()));
            scene.settle();
        }
        let [early, late] = eyes(frame);
        two.carve(frame);
        let seen = two.draw(early, late);
        one.carve(frame);
        let expected = late.map(|eye| one.draw(eye));
        assert_same(method.name(), &seen, &expected);
    }
}

#[test]
fn noise_and_dither_are_those_of_the_pose_whichever_eye_has_it() {
    let mut two = TwoEyes::new();
    let [early, late] = eyes(1);
    let mut images = Vec::new();
    for look in [OPAQUE, Look { msaa: Msaa::Sample4, ..TRANSLUCENT }, DITHERED] {
        two.set_look(look);
        let seen = two.draw(early, late);
        let [left, right] = two.draw([early[1], early[0]], [late[1], late[0]]);
        assert!([right, left] == seen, "{look:?}: the eyes show each other's poses differently");
        // Both eyes at one place.
        let [left, right] = two.draw([early[0]; 2], [late[0]; 2]);
        assert!(left == right && left == seen[0], "{look:?}: one pose looks different in two eyes");
        images.push(seen);
    }
    // What is the same is there.
    for (name, index, without) in [
        ("jitter", 0, Look { jitter: false, ..OPAQUE }),
        ("dither", 2, Look { deband: DebandDither::Disabled, ..DITHERED }),
    ] {
        two.set_look(without);
        let seen = two.draw(early, late);
        let changes: Vec<_> =
            seen[0].iter().zip(&images[index][0]).map(|(a, b)| f64::from(a.abs_diff(*b))).collect();
        let changed = changes.chunks(4).filter(|pixel| pixel.iter().any(|by| *by > 0.0)).count();
        let mean = changes.iter().sum::<f64>() / (3 * changed.max(1)) as f64;
        let most = changes.iter().copied().fold(0.0, f64::max);
        println!("{name} changes {changed} pixels, on average by {mean:.2} bytes, at most by {most}");
        assert!(changed > 200, "{name} changes {changed} pixels");
    }
}

#[test]
fn noise_that_moves_is_the_same_in_both_eyes() {
    let mut two = TwoEyes::new();
    two.set_look(TRANSLUCENT);
    let [early, late] = eyes(1);
    for camera in two.cameras {
        two.scene.world().entity_mut(camera).insert(TemporalJitter { offset: Vec2::new(0.2, -0.3) });
    }
    let mut before = Vec::new();
    for _ in 0..3 {
        let [left, right] = two.draw([early[0]; 2], [late[0]; 2]);
        assert!(left == right, "noise differs between the eyes");
        assert!(left != before, "noise is the same in every frame");
        before = left;
    }
}
