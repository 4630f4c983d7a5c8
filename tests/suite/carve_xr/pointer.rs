//! Where a hand points at the panel.

use super::*;

#[test]
fn rays_hit_the_panel_from_the_front() {
    let from = Vec3::new(0.01, 0.3, 0.4);
    for (place, on_panel) in [
        (Vec2::splat(0.5), Vec2::ZERO),
        (Vec2::new(0.1, 0.1), Vec2::new(-0.4, 0.4)),
        (Vec2::new(0.9, 0.75), Vec2::new(0.4, -0.25)),
    ] {
        let target = (SIZE * on_panel).extend(0.0);
        let hit = ray_hit(from, target - from).expect("it hits");
        assert!(hit.distance(place) < 1e-5, "{hit} for {place}");
        let behind = from * Vec3::new(1.0, 1.0, -1.0);
        assert_eq!(ray_hit(behind, target - behind), None);
        assert_eq!(ray_hit(from, from - target), None, "it points away");
    }
    assert_eq!(ray_hit(from, (SIZE * Vec2::new(0.55, 0.0)).extend(0.0) - from), None);
    assert_eq!(ray_hit(from, Vec3::X), None, "it never gets there");
}

#[test]
fn a_finger_presses_near_the_panel_and_lets_go_farther_away() {
    let tip = |distance: f32| (SIZE * Vec2::new(0.25, 0.25)).extend(distance);
    let mut was = false;
    for (distance, expected) in [
        (0.05, Some(false)),
        (0.015, Some(false)),
        (0.009, Some(true)),
        (-0.004, Some(true)),
        (0.019, Some(true)),
        (0.021, Some(false)),
        (0.015, Some(false)),
        (0.2, None),
    ] {
        let pointed = touched(tip(distance), was);
        assert_eq!(pointed.map(|pointed| pointed.is_pressed), expected, "{distance}");
        assert!(pointed.is_none_or(|pointed| pointed.place.distance(Vec2::new(0.75, 0.25)) < 1e-5));
        was = pointed.is_some_and(|pointed| pointed.is_pressed);
    }
    assert_eq!(touched(tip(0.0) + Vec3::X, false), None);
    // The ray goes elsewhere: a near finger counts.
    let controls = Controls {
        finger: Some(Vec3::new(0.0, 0.0, -0.1)),
        aim: Isometry3d::from_rotation(Quat::from_rotation_x(FRAC_PI_2)),
        is_tracked: true,
        ..Controls::new(Side::Right)
    };
    let before = Affine3A::from_translation(Vec3::new(0.0, 0.0, 0.105));
    assert_eq!(pointed(before, &controls, None), Some(Pointed { place: Vec2::splat(0.5), is_pressed: true }));
    assert_eq!(pointed(before, &Controls { finger: None, ..controls }, None), None);
    assert_eq!(pointed(before, &Controls { is_tracked: false, ..controls }, None), None);
}
