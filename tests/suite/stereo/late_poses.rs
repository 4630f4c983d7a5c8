//! Poses that come late decide what is marked, followed and drawn.

use bevy::prelude::*;

use super::rig::{Eye, OPAQUE, OneCamera, TwoEyes, assert_same, eyes_of, head_from};

/// What one camera sees at the places of both eyes.
fn expected(one: &mut OneCamera, eyes: [Eye; 2]) -> [Vec<u8>; 2] {
    eyes.map(|eye| one.draw(eye))
}

/// Heads that look at the volume: from the front, from behind and from below.
fn front() -> [Eye; 2] {
    eyes_of(head_from(Vec3::new(0.2, 0.4, 1.0)))
}

fn back() -> [Eye; 2] {
    eyes_of(head_from(Vec3::new(-0.3, -0.5, -1.0)))
}

fn below() -> [Eye; 2] {
    eyes_of(head_from(Vec3::new(0.6, -1.0, 0.1)))
}

/// A head before the volume, turned aside by degrees.
fn aside(degrees: f32) -> [Eye; 2] {
    let head = head_from(Vec3::new(0.2, 0.4, 1.0));
    eyes_of(head * Transform::from_rotation(Quat::from_rotation_y(degrees.to_radians())))
}

/// Occlusion of a fresh start with ordinary poses.
fn fresh(eyes: [Eye; 2], frame: u32) -> Vec<Option<u8>> {
    let mut fresh = TwoEyes::new();
    fresh.carve(frame);
    fresh.pose(eyes, eyes);
    fresh.settle();
    // The first frames mark more voxels: they do not know yet how precisely the device filters.
    for step_mm in [1.01, 1.02, 1.03, 1.04, 1.05, 1.0] {
        fresh.set_step_mm(step_mm);
        fresh.scene.headless.frame();
    }
    fresh.scene.occlusion()
}

/// Asserts that all occlusion of a fresh start is there.
fn assert_all_known(name: &str, two: &TwoEyes, fresh: &[Option<u8>]) {
    let has = two.scene.occlusion();
    let wanted = fresh.iter().flatten().count();
    let pairs = || fresh.iter().zip(&has).filter(|(fresh, _)| fresh.is_some());
    let missing = pairs().filter(|(_, has)| has.is_none()).count();
    let differ = pairs().filter(|(fresh, has)| has.is_some() && fresh != has).count();
    println!("{name}: {wanted} voxels are read");
    assert!(wanted > 300, "{name}: {wanted} voxels are read");
    assert_eq!([missing, differ], [0, 0], "{name}: voxels that are missing, and that differ");
}

#[test]
fn occlusion_is_that_of_late_poses() {
    let (mut two, mut one) = (TwoEyes::new(), OneCamera::new());
    two.pose(front(), front());
    two.settle();
    one.settle();
    // The main world looks from the front, the eyes from behind, and the other way round. In between, the late poses alone
    // change.
    for (name, early, late, frame) in [
        ("from behind", front(), back(), 25),
        ("from below", front(), below(), 25),
        ("from the front", back(), front(), 3),
        ("aside", front(), aside(8.0), 4),
    ] {
        two.carve(frame);
        one.carve(frame);
        let seen = two.draw(early, late);
        assert_same(name, &seen, &expected(&mut one, late));
        assert_all_known(name, &two, &fresh(late, frame));
    }
}

#[test]
fn late_poses_may_leave_the_frame_of_the_main_world() {
    let (mut two, mut one) = (TwoEyes::new(), OneCamera::new());
    for scene in [&mut *two, &mut *one] {
        scene.set_look(OPAQUE);
    }
    // The main world sees an edge of the volume's box, of the volume next to nothing.
    for (frame, degrees) in [(1, 30.0), (2, -30.0), (3, 26.0)] {
        two.carve(frame);
        one.carve(frame);
        let seen = two.draw(aside(degrees), front());
        let alone = two.draw(aside(degrees), aside(degrees))[0].clone();
        let shown = alone.chunks(4).filter(|pixel| **pixel != alone[..4]).count();
        println!("the main world sees {shown} pixels of the volume");
        assert_same(&format!("{degrees} degrees aside"), &seen, &expected(&mut one, front()));
    }
    // The eyes look away, the main world does not: they see nothing. Then they look back.
    two.carve(4);
    one.carve(4);
    let seen = two.draw(front(), aside(150.0));
    assert!(seen.iter().all(|image| image.chunks(4).all(|pixel| *pixel == image[..4])), "they see it");
    let seen = two.draw(front(), front());
    assert_same("back again", &seen, &expected(&mut one, front()));
    // The main world looks away, and culls the volume as it culls meshes. The next frame is right.
    two.carve(5);
    one.carve(5);
    let seen = two.draw(aside(150.0), front());
    assert!(seen.iter().all(|image| image.chunks(4).all(|pixel| *pixel == image[..4])), "it is not culled");
    let seen = two.draw(aside(30.0), front());
    assert_same("no longer culled", &seen, &expected(&mut one, front()));
    assert_all_known("no longer culled", &two, &fresh(front(), 5));
}
