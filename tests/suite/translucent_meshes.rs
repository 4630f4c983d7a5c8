//! Volumes among the translucent meshes of views that sort fragments (`OrderIndependentTransparencySettings`).

use bevy::{
    camera::Viewport, core_pipeline::oit::OrderIndependentTransparencySettings, math::DVec3, prelude::*,
};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::{mode::ShadingMode, scene::view_from};

use crate::{
    balls::Balls,
    scene::{IMAGE, TestScene, few_rays, folded_volume, opaque_ramp, translucent_ramp},
};

/// Colours of fragments have 9 bits, opacities 8: half a step of each, at a light of 0.6.
const MOST: f64 = 0.6 / 512.0 + 0.6 * 0.5 / 255.0 + 0.001;

fn sorted() -> OrderIndependentTransparencySettings {
    default()
}

/// A sheet that leans back into the ball; its middle is moved upwards within its plane, mm.
fn sheet_into(shift: f32) -> Transform {
    let turn = Quat::from_rotation_x(-0.6);
    Transform::from_translation(Vec3::new(0.0, -2.0, 10.0) + turn * Vec3::Y * shift).with_rotation(turn)
}

#[test]
fn sheets_show_where_they_are_in_front_alone() {
    let mut balls = Balls::new();
    let camera = balls.scene.camera();
    balls.scene.world().entity_mut(camera).insert(sorted());
    let size = Vec2::new(40.0, 60.0);
    for (name, pose) in [
        ("behind", Transform::from_xyz(0.0, 0.0, -20.0)),
        ("before", Transform::from_xyz(0.0, 0.0, 20.0)),
        ("into the ball, its middle nearer than the ball's", sheet_into(0.0)),
        ("into the ball, its middle farther", sheet_into(22.0)),
    ] {
        balls.add_sheet(pose, size);
        balls.settle();
        let seen = balls.compare();
        println!("{name}: {seen:?}");
        let both = seen.before.min(seen.behind);
        assert!(
            seen.before + seen.behind > 300 && (both > 100) == name.starts_with("into"),
            "{name}: {seen:?}"
        );
        assert!(seen.largest < MOST, "{name}: {seen:?}");
        balls.clear();
    }
    // Several sheets, in front and behind.
    for z in [-18.0, 16.0, 20.0] {
        balls.add_sheet(Transform::from_xyz(0.0, 0.0, z), size);
    }
    balls.settle();
    let seen = balls.compare();
    assert!(seen.before > 300 && seen.behind > 300 && seen.largest < 2.0 * MOST, "{seen:?}");
}

#[test]
fn a_sheet_in_a_carved_hollow_shows_in_it() {
    let mut balls = Balls::new();
    let camera = balls.scene.camera();
    balls.halve();
    balls.scene.world().entity_mut(camera).insert((sorted(), view_from(Vec3::new(40.0, 10.0, 45.0))));
    balls.add_sheet(Transform::from_xyz(0.0, 0.0, 1.0), Vec2::new(50.0, 20.0));
    balls.settle();
    let seen = balls.compare();
    assert!(seen.before > 50 && seen.behind > 50 && seen.largest < MOST, "{seen:?}");
}

/// Views of a volume with nothing else translucent in them, sorted or not.
#[test]
fn a_volume_alone_looks_the_same() {
    let volume = folded_volume(UVec3::splat(20), DVec3::ONE);
    for (name, function) in [("opaque", opaque_ramp()), ("translucent", translucent_ramp())] {
        let mut scene = TestScene::new(volume.clone(), function, few_rays(), ShadingMode::PhongCao);
        scene.carve(Cuboid::new(9.0, 9.0, 30.0), ClipMesh::default(), Transform::from_xyz(3.0, 2.0, 5.0));
        scene.settle();
        let plain = scene.headless.image();
        let camera = scene.camera();
        scene.world().entity_mut(camera).insert(sorted());
        scene.headless.frames(3);
        let sorted = scene.headless.image();
        let off = plain.iter().zip(&sorted).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or_default();
        let shown = sorted.chunks(4).filter(|pixel| **pixel != sorted[..4]).count();
        println!("{name}: {shown} pixels, off by at most {off} bytes");
        // Opacities of 8 bits in front of a dark background: a byte, another one where colours round.
        assert!(shown > 500 && off <= 2, "{name}: {shown} pixels, off by {off} bytes");
    }
}

#[test]
fn viewports_beside_each_other_show_what_a_view_alone_shows() {
    let pictures = |sides: &[u32]| {
        let mut balls = Balls::new();
        balls.add_sheet(sheet_into(0.0), Vec2::new(40.0, 60.0));
        let first = balls.scene.camera();
        balls.scene.world().despawn(first);
        let size = UVec2::new(IMAGE.x / 2, IMAGE.y);
        for side in sides {
            let viewport = Viewport {
                physical_position: UVec2::new(side * size.x, 0),
                physical_size: size,
                ..default()
            };
            let clear_color = if *side == sides[0] { default() } else { ClearColorConfig::None };
            let camera_of =
                Camera { viewport: Some(viewport), order: *side as isize, clear_color, ..default() };
            let near = Projection::Perspective(PerspectiveProjection { near: 1e-4, ..default() });
            let x = if *side == 0 { -20.0 } else { 30.0 };
            let camera = balls.scene.headless.camera();
            let place = view_from(Vec3::new(x, 5.0, 60.0));
            let camera = balls.scene.world().spawn((camera, camera_of, near, place, sorted())).id();
            balls.scene.world().entity_mut(camera).insert(bevy::camera::Hdr);
        }
        balls.settle();
        balls.scene.headless.light()
    };
    let both = pictures(&[0, 1]);
    for side in [0, 1] {
        let alone = pictures(&[side]);
        let is_in = |index: usize| index as u32 % IMAGE.x / (IMAGE.x / 2) == side;
        let pairs = both.iter().zip(&alone).enumerate().filter(|(index, _)| is_in(*index));
        let shown = pairs.clone().filter(|(_, (_, alone))| alone[0] > 0.1).count();
        let off = pairs.filter(|(_, (both, alone))| both != alone).count();
        assert!(shown > 200, "viewport {side} shows the ball in {shown} pixels");
        assert_eq!(off, 0, "pixels of viewport {side} differ from those of a view alone");
    }
}
