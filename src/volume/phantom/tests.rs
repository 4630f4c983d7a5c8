//! The phantom must stay a plausible head, and the same one everywhere.

use super::{HeadField, head_phantom};
use bevy::math::{UVec3, Vec3};

/// Share of the values that lie in a range.
fn share(values: &[i16], range: std::ops::RangeInclusive<i16>) -> f32 {
    values.iter().filter(|value| range.contains(value)).count() as f32 / values.len() as f32
}

#[test]
fn has_the_documented_shape() {
    let head = head_phantom(40);
    assert_eq!(head.dimensions, UVec3::new(30, 36, 40));
    assert_eq!(head.values.len(), 30 * 36 * 40);
    assert_eq!(head.spacing_mm, 6.0);
    // Sizes out of range are clamped.
    assert_eq!(head_phantom(0).values.len(), 1);
}

#[test]
fn is_deterministic() {
    assert_eq!(head_phantom(48), head_phantom(48));
}

#[test]
fn contains_all_tissues() {
    let values = head_phantom(80).values;
    let in_range = |range, low: f32, high: f32| {
        let share = share(&values, range);
        assert!((low..high).contains(&share), "share {share} of {low}..{high}");
    };
    in_range(-1000..=-900, 0.3, 0.7); // air
    in_range(-120..=-20, 0.1, 0.4); // soft tissue
    in_range(-5..=15, 0.01, 0.1); // fluid
    in_range(25..=45, 0.05, 0.3); // brain
    in_range(280..=320, 0.001, 0.03); // vessels
    in_range(400..=1400, 0.05, 0.2); // bone
    in_range(1800..=2000, 0.0002, 0.01); // teeth
}

#[test]
fn skull_encloses_the_brain() {
    let field = HeadField::new(240);
    let centre = Vec3::new(3.0, -12.0, 44.0);
    let (mut hits, mut rays) = (0, 0);
    for i in 0..200_u8 {
        // Evenly spread directions, without directions to the foramen magnum.
        let z = 1.0 - f32::from(i) / 200.0 * 1.4;
        let turn = f32::from(i) * 2.4;
        let direction = Vec3::new(turn.cos(), turn.sin(), 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z;
        rays += 1;
        hits += u32::from((0..240).any(|step| field.value(centre + direction * (0.5 * step as f32)) > 400.0));
    }
    assert!(hits * 100 >= rays * 98, "bone on {hits} of {rays} rays");
}

#[test]
fn brain_is_folded_and_split() {
    let field = HeadField::new(240);
    // The fissure between the hemispheres is fluid, and brain lies on both sides.
    for y in [-30.0, 0.0, 25.0] {
        assert!(field.value(Vec3::new(0.0, y, 80.0)) < 15.0);
    }
    // Walking over the cortex just below its hull meets many sulci.
    let walk: Vec<bool> = (0..240)
        .map(|step| {
            let turn = step as f32 / 240.0 * std::f32::consts::TAU;
            let p = Vec3::new(turn.cos() * 47.0, -12.0 + turn.sin() * 63.0, 55.0);
            field.value(p) < 18.0
        })
        .collect();
    let changes = walk.windows(2).filter(|pair| pair[0] != pair[1]).count();
    assert!(changes > 12, "{changes} changes");
}
