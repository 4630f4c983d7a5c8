//! How held things move, against closed forms.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::random::Random;
use core::f64::consts::TAU;

use super::bench::{Bench, difference, parents, pose, thing};

/// Single precision rounds poses within some metres by that much.
const ROUNDING: f64 = 1e-6;

#[test]
fn a_thing_in_one_hand_keeps_its_place_in_the_hand() {
    let mut random = Random(1);
    let mut most = 0.0f64;
    for parents in parents() {
        for _ in 0..8 {
            let mut bench = Bench::new(&parents, thing(&mut random));
            let start = bench.get::<Transform>(bench.thing);
            bench.place(0, pose(&mut random));
            bench.grip([true, false]);
            assert_eq!(bench.holders(), [bench.hands[0]]);
            assert_eq!(bench.get::<Transform>(bench.thing), start, "the grab moves it");
            let in_hand = |bench: &Bench| bench.world(bench.hands[0]).inverse() * bench.world(bench.thing);
            let expected = in_hand(&bench);
            for _ in 0..8 {
                bench.place(0, pose(&mut random));
                bench.app.update();
                most = most.max(difference(in_hand(&bench), expected));
            }
            let last = bench.get::<Transform>(bench.thing);
            bench.grip([false, false]);
            bench.place(0, pose(&mut random));
            bench.app.update();
            assert_eq!(bench.get::<Transform>(bench.thing), last, "it follows an open hand");
        }
    }
    println!("off by at most {most:.1e}");
    assert!(most < ROUNDING, "off by {most:.1e}");
}

#[test]
fn two_hands_keep_their_points_and_scale_by_their_distance() {
    let mut random = Random(2);
    let (mut most, mut most_scale) = (0.0f64, 0.0f64);
    for parents in parents() {
        for _ in 0..8 {
            let mut bench = Bench::new(&parents, thing(&mut random));
            let grab = [pose(&mut random), pose(&mut random)];
            for (hand, pose) in grab.into_iter().enumerate() {
                bench.place(hand, pose);
            }
            let start = bench.get::<Transform>(bench.thing);
            bench.grip([true, true]);
            assert_eq!(bench.holders().len(), 2);
            let points = |bench: &Bench| bench.hands.map(|hand| bench.world(hand).translation);
            let (world_from_thing, at_grab) = (bench.world(bench.thing), points(&bench));
            let in_thing = at_grab.map(|point| world_from_thing.inverse().transform_point3(point));
            for _ in 0..8 {
                for hand in 0..2 {
                    bench.place(hand, pose(&mut random));
                }
                bench.app.update();
                let now = points(&bench);
                let moved = bench.world(bench.thing);
                let off = [0, 1].map(|hand| moved.transform_point3(in_thing[hand]).distance(now[hand]));
                let ratio = now[0].distance(now[1]) / at_grab[0].distance(at_grab[1]);
                most = most.max(off[0].max(off[1]) / ratio.max(1.0));
                let scale = bench.get::<Transform>(bench.thing).scale / start.scale;
                let by = scale.as_dvec3() / ratio - DVec3::ONE;
                most_scale = most_scale.max(by.abs().max_element());
            }
            for (hand, pose) in grab.into_iter().enumerate() {
                bench.place(hand, pose);
            }
            bench.app.update();
            assert_eq!(bench.get::<Transform>(bench.thing), start, "it does not come back");
        }
    }
    println!("points off by at most {most:.1e}, scale by a share of {most_scale:.1e}");
    assert!(most < ROUNDING && most_scale < ROUNDING, "{most:.1e}, {most_scale:.1e}");
}

/// A bench with a hand on either side of a thing, which both grip.
fn bar(random: &mut Random) -> Bench {
    let mut bench = Bench::new(&parents()[4], thing(random));
    for (hand, side) in [(0, -0.3), (1, 0.3)] {
        bench.place(hand, Transform::from_xyz(side, 0.0, 0.0).with_rotation(random.rotation(3.0)));
    }
    bench.grip([true, true]);
    bench
}

#[test]
fn twists_about_the_line_between_the_hands_are_averaged() {
    let mut random = Random(3);
    for _ in 0..10 {
        let mut bench = bar(&mut random);
        let poses = bench.hands.map(|hand| bench.get::<Transform>(hand));
        let line =
            (bench.world(bench.hands[1]).translation - bench.world(bench.hands[0]).translation).normalize();
        let start = bench.rotation(bench.thing);
        // Up to 340 degrees between the hands, which no wrists reach.
        let ends = [3.4 * random.signed().signum(), 2.5 * random.signed()];
        for step in 1..=20 {
            let twists = ends.map(|end| end * step as f32 / 20.0);
            for hand in 0..2 {
                let turn = Quat::from_rotation_x(twists[hand]);
                bench.place(hand, Transform { rotation: turn * poses[hand].rotation, ..poses[hand] });
            }
            bench.app.update();
            let mean = f64::from(twists[0] + twists[1]) / 2.0;
            let expected = bevy::math::DQuat::from_axis_angle(line, mean) * start;
            let off = bench.rotation(bench.thing).angle_between(expected);
            assert!(off < 2e-6, "step {step}: {off} radians from the mean of {twists:?}");
        }
    }
}

#[test]
fn hands_that_turn_as_a_whole_turn_the_thing_by_any_angle() {
    let mut random = Random(4);
    for _ in 0..5 {
        let mut bench = bar(&mut random);
        let poses = bench.hands.map(|hand| bench.get::<Transform>(hand));
        let in_hand = |bench: &Bench| bench.world(bench.hands[0]).inverse() * bench.world(bench.thing);
        let expected = in_hand(&bench);
        let axis = Dir3::new(random.point().with_x(0.1)).unwrap_or(Dir3::Y);
        // Two turns, with steps that meet half a turn.
        for step in 1..=64 {
            let turn =
                Transform::from_rotation(Quat::from_axis_angle(*axis, (step as f64 * TAU / 32.0) as f32));
            bench.place_both(poses.map(|pose| turn * pose));
            bench.app.update();
            let off = difference(in_hand(&bench), expected);
            assert!(off < 2.0 * ROUNDING, "step {step}: {off:.1e}");
        }
    }
}

#[test]
fn a_hand_that_comes_or_goes_moves_nothing() {
    let mut random = Random(5);
    for parents in parents() {
        let mut bench = Bench::new(&parents, thing(&mut random));
        let mut grips = [false, false];
        for step in 0..40 {
            for hand in 0..2 {
                bench.place(hand, pose(&mut random));
            }
            bench.app.update();
            let before = bench.get::<Transform>(bench.thing);
            grips[random.below(2)] ^= true;
            bench.grip(grips);
            bench.app.update();
            assert_eq!(bench.get::<Transform>(bench.thing), before, "it jumps at step {step}");
        }
        // A hand that opens while both move takes the thing along up to there.
        bench.grip([false, false]);
        bench.grip([true, true]);
        let world_from_thing = bench.world(bench.thing).inverse();
        let points = bench.hands.map(|hand| world_from_thing.transform_point3(bench.world(hand).translation));
        for hand in 0..2 {
            bench.place(hand, pose(&mut random));
        }
        bench.grip([true, false]);
        for (hand, point) in bench.hands.into_iter().zip(points) {
            let at = bench.world(bench.thing).transform_point3(point);
            assert!(at.distance(bench.world(hand).translation) < 4.0 * ROUNDING);
        }
    }
}

#[test]
fn limits_and_locks_hold_and_the_middle_stays() {
    let mut random = Random(6);
    let scale = Vec3::new(0.5, 1.0, 0.8);
    let limits = Grabbable { min_scale: 0.5, max_scale: 2.0, ..default() };
    for grabbable in [
        limits,
        Grabbable { lock_scale: true, ..limits },
        Grabbable { lock_rotation: true, ..limits },
        Grabbable { lock_scale: true, lock_rotation: true, ..limits },
        Grabbable { min_scale: f32::NAN, max_scale: f32::NAN, ..limits },
        Grabbable { min_scale: 3.0, max_scale: 0.1, ..limits },
    ] {
        let start = pose(&mut random).with_scale(scale);
        let mut bench = Bench::new(&parents()[2], (grabbable, start));
        for hand in 0..2 {
            bench.place(hand, pose(&mut random));
        }
        bench.grip([true, true]);
        let middle = |bench: &Bench| {
            let [a, b] = bench.hands.map(|hand| bench.world(hand).translation);
            (a + b) / 2.0
        };
        let in_thing = bench.world(bench.thing).inverse().transform_point3(middle(&bench));
        let mut sizes = Vec::new();
        for stretch in [1e-2, 0.3, 1.0, 4.0, 1e3] {
            for hand in 0..2 {
                let mut pose = pose(&mut random);
                pose.translation *= stretch;
                bench.place(hand, pose);
            }
            bench.app.update();
            let now = bench.get::<Transform>(bench.thing);
            assert!((now.scale / now.scale.y - scale).abs().max_element() < 1e-6, "it is distorted");
            assert!(!grabbable.lock_rotation || now.rotation == start.rotation);
            sizes.push(now.scale.y);
            let off = bench.world(bench.thing).transform_point3(in_thing).distance(middle(&bench));
            assert!(off < 3.0 * ROUNDING * f64::from(stretch.max(1.0)), "the middle is off by {off}");
        }
        let [least, most] = [f32::min, f32::max].map(|of| sizes.iter().copied().fold(sizes[0], of));
        let is_free = !grabbable.lock_scale && grabbable.min_scale == 0.5;
        let expected = if is_free { 0.5..=2.0 } else { 1.0..=1.0 };
        assert!(least == *expected.start() && most == *expected.end(), "{sizes:?} for {grabbable:?}");
    }
}

#[test]
fn ten_thousand_frames_add_no_drift() {
    let mut random = Random(7);
    let mut bench = Bench::new(&parents()[2], thing(&mut random));
    let grab = [pose(&mut random), pose(&mut random)];
    let start = bench.get::<Transform>(bench.thing);
    bench.place_both(grab);
    bench.grip([true, true]);
    let points = |bench: &Bench| bench.hands.map(|hand| bench.world(hand).translation);
    let inverse = bench.world(bench.thing).inverse();
    let in_thing = points(&bench).map(|point| inverse.transform_point3(point));
    let mut most = 0.0f64;
    for frame in 0..10_000 {
        for (hand, grab) in grab.into_iter().enumerate() {
            // Hands sway, as far as wrists go.
            let sway = |speed: f32| (speed * (1.0 + hand as f32) * frame as f32).sin();
            let turn =
                Quat::from_euler(EulerRot::XYZ, 1.2 * sway(0.011), 1.2 * sway(0.017), 1.2 * sway(0.023));
            let shift = 0.2 * Vec3::new(sway(0.013), sway(0.019), sway(0.029)) + 1e-3 * random.point();
            let Transform { translation, rotation, .. } = grab;
            bench
                .place(hand, Transform::from_translation(translation + shift).with_rotation(turn * rotation));
        }
        bench.app.update();
        if frame % 100 == 99 {
            let (now, moved) = (points(&bench), bench.world(bench.thing));
            let off = [0, 1].map(|hand| moved.transform_point3(in_thing[hand]).distance(now[hand]));
            most = most.max(off[0].max(off[1]));
        }
    }
    println!("off by at most {most:.1e}");
    assert!(most < 2.0 * ROUNDING, "off by {most:.1e}");
    bench.place_both(grab);
    bench.app.update();
    assert_eq!(bench.get::<Transform>(bench.thing), start);
}
