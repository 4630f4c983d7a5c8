//! Lower jaw, teeth and the ridges that carry them, all mirrored to x >= 0.

use super::sdf::{at, capsule, ellipse, ellipsoid, smooth_intersection, smooth_union};
use bevy::math::{Vec2, Vec3};

/// Distance to the curve of the dental arch, seen from above.
fn arch_curve(p: Vec2, centre_y: f32, radii: Vec2) -> f32 {
    let p = p - Vec2::new(0.0, centre_y);
    if p.y > 0.0 { ellipse(p, radii).abs() } else { (p - Vec2::new(radii.x, 0.0)).length() }
}

/// Rounded ridge along the teeth, `half` thick, between two heights.
pub(super) fn dental_arch(q: Vec3, half: f32, bottom: f32, top: f32) -> f32 {
    let across = arch_curve(Vec2::new(q.x, q.y), 32.0, Vec2::new(25.0, 34.0)) - half;
    let along = (bottom - q.z).max(q.z - top);
    smooth_intersection(across, along, 3.0)
}

/// Lower jaw: chin, body, ramus, condyle and coronoid process.
pub(super) fn mandible(q: Vec3) -> f32 {
    let across = arch_curve(Vec2::new(q.x, q.y), 14.0, Vec2::new(42.0, 53.0));
    let body_height = (q.z + 75.0 - 0.2 * (67.0 - q.y)).abs() - 9.5;
    let body = smooth_intersection(across - 5.0, body_height, 5.0);
    let chin = ellipsoid(q, at(0.0, 65.0, -79.0), at(14.0, 8.0, 7.0));
    // The ramus is a plate: wide from front to back, thin from side to side.
    let lean = q.x - (46.0 + 0.14 * (q.z + 50.0));
    let ramus = capsule(q, (at(43.0, 13.0, -61.0), 12.0), (at(50.0, 4.0, -34.0), 11.0));
    let ramus = smooth_intersection(ramus, lean.abs() - 4.4, 3.0);
    let condyle = capsule(q, (at(50.0, -1.0, -32.0), 4.0), (at(52.0, -2.0, -18.0), 5.0));
    let coronoid = capsule(q, (at(49.0, 13.0, -34.0), 5.0), (at(50.0, 17.0, -17.0), 2.5));
    let d = smooth_union(body, dental_arch(q, 4.8, -70.0, -58.0), 6.0);
    [chin, ramus, condyle, coronoid].into_iter().fold(d, |d, part| smooth_union(d, part, 5.0))
}

/// Distance to the teeth.
pub(super) fn teeth(q: Vec3) -> f32 {
    // Right half of the arch, from the incisor to the last molar: x, y and radius of each tooth.
    const ROOTS: [(f32, f32, f32); 7] = [
        (4.2, 65.4, 3.6),
        (11.6, 62.2, 3.4),
        (17.6, 56.6, 3.7),
        (21.8, 49.6, 3.6),
        (24.2, 42.2, 3.7),
        (25.2, 33.4, 4.6),
        (25.2, 23.6, 4.6),
    ];
    if q.z > -34.0 || q.z < -68.0 || q.y < 12.0 || q.x > 36.0 {
        return 10.0;
    }
    ROOTS
        .iter()
        .map(|&(x, y, r)| {
            let upper = capsule(q, (at(x, y, -37.0), r * 0.7), (at(x, y, -47.5), r));
            let lower = capsule(q, (at(x, y - 1.0, -62.0), r * 0.7), (at(x, y - 1.0, -51.5), r));
            // Flat biting edges, slightly apart, keep the rows separate.
            upper.max(-48.4 - q.z).min(lower.max(q.z + 50.4))
        })
        .fold(f32::MAX, f32::min)
}
