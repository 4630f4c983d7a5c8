//! A volume and its carvers under one parent, like a carved head in the hand. A rig that moves as a whole costs as
//! much as a camera move.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{
    diagnostics::{SPAN_CLIP, SPAN_CULL, SPAN_DILATE},
    prelude::*,
    volume::WORLD_UNITS_PER_MM,
};
use contextual_ao_kit::mode::ShadingMode;

use crate::scene::{TestScene, count_different, few_rays, folded_volume, in_world_units, opaque_ramp};

/// A scene whose volume and carver hang from a parent. The camera has no parent.
struct Rig {
    scene: TestScene,
    root: Entity,
    place: Vec3,
}

impl Rig {
    fn new(place: Vec3, scale: f32) -> Self {
        let volume = folded_volume(UVec3::new(28, 25, 23), DVec3::ONE);
        let mut scene = TestScene::new(volume, opaque_ramp(), few_rays(), ShadingMode::Cao);
        let pose = Transform::from_xyz(5.0, 4.0, 3.0).with_rotation(Quat::from_rotation_z(0.3));
        let carver = scene.carve(Sphere::new(7.0), ClipMesh::default(), pose);
        let (volume, camera) = (scene.volume, scene.camera());
        let world = scene.world();
        let root = world.spawn((Transform::default(), Visibility::default())).id();
        // An arm lies between parent and children, as in a skeleton.
        let arm = in_world_units(Transform::from_xyz(3.0, -2.0, 1.0)).with_scale(Vec3::ONE);
        let arm = world.spawn((arm, Visibility::default(), ChildOf(root))).id();
        world.entity_mut(volume).insert(ChildOf(arm));
        world.entity_mut(carver).insert(ChildOf(arm));
        world.get_mut::<Transform>(camera).expect("a camera").translation *= scale;
        let mut rig = Self { scene, root, place };
        let camera_from_world = rig.scene.world().get::<Transform>(camera).copied().expect("a camera");
        let moved = camera_from_world.with_translation(camera_from_world.translation + place);
        rig.scene.world().entity_mut(camera).insert(moved);
        rig.turn(0, scale);
        rig.scene.settle();
        rig.scene.headless.frame();
        rig
    }

    fn turn(&mut self, step: u32, scale: f32) {
        let angle = 0.05 * step as f32;
        let sway = Vec3::new(angle.sin(), 0.3 * angle, -angle.cos()) * 2.0 * WORLD_UNITS_PER_MM;
        let pose = Transform::from_translation(self.place + sway * scale)
            .with_rotation(Quat::from_euler(EulerRot::YXZ, angle, 0.4 * angle, 0.1))
            .with_scale(Vec3::splat(scale));
        let root = self.root;
        self.scene.world().entity_mut(root).insert(pose);
    }
}

#[test]
fn a_rig_that_moves_as_a_whole_is_not_carved_anew() {
    // Places: in the hand, in a house, and far from the origin, where single precision resolves 60 micrometres.
    for (place, scale) in
        [(Vec3::ZERO, 1.0), (Vec3::new(12.0, 1.5, -7.0), 1.7), (Vec3::new(900.0, 1.5, 70.0), 1.0)]
    {
        let mut rig = Rig::new(place, scale);
        let before = rig.scene.status().passes;
        for step in 1..=40 {
            rig.turn(step, scale);
            rig.scene.headless.frame();
        }
        rig.scene.headless.frame();
        let after = rig.scene.status().passes;
        for span in [SPAN_CULL, SPAN_CLIP, SPAN_DILATE] {
            assert_eq!(after.jobs(span), before.jobs(span), "{span} at {place}");
        }
        let mut fresh = Rig::new(place, scale);
        fresh.turn(40, scale);
        fresh.scene.headless.frame();
        fresh.scene.headless.frame();
        assert_eq!(count_different(&rig.scene.occlusion(), &fresh.scene.occlusion()), 0, "at {place}");
        assert!(rig.scene.headless.image() == fresh.scene.headless.image(), "at {place}");
    }
}
