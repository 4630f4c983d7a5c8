//! The outside of the head: face, ears and neck, and the air ways that open to it.
//!
//! All functions take a position mirrored to x >= 0: the outside is symmetric.

use super::sdf::{at, capsule, ellipsoid, smooth_cut, smooth_intersection, smooth_union, sphere, tube};
use super::skull;
use bevy::math::{Mat2, Vec2, Vec3};

/// Centre of the eyeball.
pub(super) const EYE: Vec3 = at(30.0, 57.0, 10.0);
/// Radius of the eyeball.
pub(super) const EYE_RADIUS: f32 = 12.0;

/// Cheap distance to a hull around the whole head, to skip the air around it.
pub(super) fn bound(q: Vec3) -> f32 {
    let head = ellipsoid(q, at(0.0, -4.0, 20.0), at(90.0, 135.0, 150.0));
    let neck = capsule(q, (at(0.0, -20.0, -30.0), 72.0), (at(0.0, -30.0, -160.0), 72.0));
    head.min(neck)
}

/// Distance to the skin. `bone` is the distance to the skull, which always stays covered.
pub(super) fn skin(q: Vec3, bone: f32) -> f32 {
    let d = smooth_union(head_shape(q), bone - 3.5, 4.0);
    let d = face(q, d);
    smooth_union(d, ear(q), 4.0)
}

/// Cranium, cheeks, jaw and neck without features.
fn head_shape(q: Vec3) -> f32 {
    let cranium = ellipsoid(q, at(0.0, -12.0, 41.0), at(72.5, 91.5, 75.5));
    let temple = ellipsoid(q, at(0.0, -8.0, 2.0), at(68.0, 60.0, 50.0));
    let face = ellipsoid(q, at(0.0, 20.0, -18.0), at(52.0, 54.0, 62.0));
    let jaw = ellipsoid(q, at(0.0, 30.0, -58.0), at(38.0, 43.0, 27.0));
    let neck = capsule(q, (at(0.0, -24.0, -30.0), 48.0), (at(0.0, -36.0, -160.0), 56.0));
    let masseter = ellipsoid(q, at(42.0, 9.0, -38.0), at(16.0, 26.0, 32.0));
    let cheek = ellipsoid(q, at(28.0, 44.0, -44.0), at(18.0, 22.0, 28.0));
    let d = smooth_union(smooth_union(cranium, temple, 16.0), face, 18.0);
    let d = smooth_union(smooth_union(d, jaw, 18.0), masseter, 14.0);
    let d = smooth_union(d, cheek, 14.0);
    smooth_union(d, neck, 14.0)
}

/// Adds brow, eyes, nose, mouth and chin to the head shape `d`.
fn face(q: Vec3, d: f32) -> f32 {
    if q.y < 30.0 {
        // No feature reaches back this far.
        return d;
    }
    let brow = capsule(q, (at(5.0, 71.0, 24.0), 8.0), (at(34.0, 64.0, 26.0), 7.0));
    let d = smooth_union(d, brow, 10.0);
    let d = smooth_union(d, sphere(q, at(37.0, 46.0, -15.0), 20.0), 16.0);
    let d = smooth_union(d, sphere(q, at(0.0, 66.0, -77.0), 14.0), 12.0);
    mouth(q, nose(q, eyes(q, d)))
}

/// Sinks the eye sockets into `d` and closes the lids over the eyeballs.
fn eyes(q: Vec3, d: f32) -> f32 {
    let socket = ellipsoid(q, EYE + at(-1.0, 27.0, 0.5), at(17.0, 18.0, 11.5));
    let d = smooth_cut(d, socket, 10.0);
    let from_eye = q.distance(EYE);
    let d = smooth_union(d, from_eye - EYE_RADIUS - 2.2, 2.5);
    // The lids meet in a groove that sags in the middle, as closed eyes do.
    smooth_cut(d, tube(q, &LID_LINE), 2.5)
}

/// Course of the groove between the lids and its radius.
const LID_LINE: [(Vec3, f32); 5] = [
    (at(19.0, 65.2, 6.5), 0.7),
    (at(23.0, 68.3, 5.0), 1.1),
    (at(30.0, 70.1, 4.5), 1.2),
    (at(37.0, 68.3, 5.0), 1.1),
    (at(41.0, 65.2, 6.5), 0.7),
];

/// Adds the nose to `d`.
fn nose(q: Vec3, d: f32) -> f32 {
    let ridge =
        tube(q, &[(at(0.0, 74.0, 20.0), 5.0), (at(0.0, 80.0, 2.0), 6.0), (at(0.0, 90.5, -22.0), 7.5)]);
    let wing = ellipsoid(q, at(10.0, 82.0, -26.5), at(6.5, 9.0, 6.5));
    let side = capsule(q, (at(5.0, 76.0, 4.0), 5.0), (at(10.0, 78.0, -24.0), 6.0));
    let d = smooth_union(smooth_union(d, side, 9.0), ridge, 7.0);
    smooth_union(d, wing, 4.0)
}

/// Adds the lips to `d`.
fn mouth(q: Vec3, d: f32) -> f32 {
    // The lips follow the curve of the teeth behind them.
    let bent = at(q.x, q.y + 0.016 * q.x * q.x, q.z);
    let upper =
        tube(bent, &[(at(0.0, 77.5, -44.6), 4.6), (at(6.0, 78.0, -43.8), 4.8), (at(23.0, 75.0, -48.0), 2.2)]);
    let lower = capsule(bent, (at(0.0, 76.6, -52.6), 5.4), (at(20.0, 75.0, -49.2), 2.2));
    let cleft = capsule(bent, (at(0.0, 83.5, -48.6), 1.9), (at(20.0, 79.5, -48.6), 1.2));
    let philtrum = capsule(q, (at(0.0, 86.0, -34.0), 2.2), (at(0.0, 84.5, -40.0), 2.2));
    let d = smooth_union(smooth_union(d, upper, 4.0), lower, 4.0);
    smooth_cut(smooth_cut(d, cleft, 2.0), philtrum, 3.0)
}

/// Distance to the outer ear: a tilted shell with a rolled rim.
fn ear(q: Vec3) -> f32 {
    let from_centre = q - at(68.0, -20.0, -3.0);
    if from_centre.length_squared() > 50.0 * 50.0 {
        // Far away the distance to the bounding ball is enough.
        return from_centre.length() - 34.0;
    }
    // The rear edge stands off the head: turn about z by some 25 degrees.
    let turned =
        Mat2::from_cols_array(&[0.906, -0.423, 0.423, 0.906]) * Vec2::new(from_centre.x, from_centre.y);
    // The top leans backwards, and the lobe is narrower than the top.
    let p = at(turned.x, turned.y + 0.22 * from_centre.z, from_centre.z);
    let width = 15.5 + 0.12 * p.z;
    let plate = ellipsoid(p, Vec3::ZERO, at(6.5, width, 28.0));
    let hollow = ellipsoid(p, at(6.0, 1.0, 4.0), at(5.5, width - 5.5, 19.0));
    let bowl = ellipsoid(p, at(4.0, 4.5, -3.0), at(7.5, 7.0, 9.0));
    let fold = capsule(p, (at(3.4, -4.0, -8.0), 1.8), (at(3.4, -3.5, 14.0), 2.2));
    let tragus = sphere(p, at(3.0, 11.5, -4.0), 3.6);
    let d = smooth_union(smooth_cut(plate, hollow, 3.0), fold, 2.5);
    smooth_union(smooth_cut(d, bowl, 2.5), tragus, 2.5)
}

/// Distance to the air inside the head. `skin` keeps the nose closed in front.
pub(super) fn air(q: Vec3, skin: f32) -> f32 {
    let lined = skull::nasal_cavity(q) + 1.5;
    let nasal = smooth_intersection(lined, skin + 4.5, 2.0);
    // Conchae hang into the nasal cavity from its side walls.
    let concha = |z: f32, r: f32| capsule(q, (at(8.5, 22.0, z), r), (at(8.0, 58.0, z), r)).max(6.0 - q.x);
    let nasal = nasal.max(-concha(-9.0, 2.6)).max(-concha(-20.0, 3.6));
    let nostril = capsule(q, (at(6.5, 86.0, -36.0), 3.4), (at(5.0, 76.0, -20.0), 3.8));
    let throat = tube(
        q,
        &[
            (at(0.0, 10.0, -14.0), 7.0),
            (at(0.0, 8.0, -38.0), 5.5),
            (at(0.0, 6.0, -72.0), 6.5),
            (at(0.0, 4.0, -130.0), 8.0),
        ],
    );
    let palate_gap = ellipsoid(q, at(0.0, 38.0, -40.0), at(17.0, 23.0, 2.4));
    let canal = tube(
        q,
        &[(at(74.0, -14.0, -7.0), 3.2), (at(62.0, -13.0, -10.0), 2.8), (at(46.0, -10.0, -11.0), 2.4)],
    );
    [nasal, nostril, throat, palate_gap, canal, skull::sinuses(q)].into_iter().fold(f32::MAX, f32::min)
}
