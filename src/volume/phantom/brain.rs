//! Cerebrum with folded cortex, cerebellum, brain stem and ventricles.

use super::sdf::{
    at, capsule, ellipsoid, noise, ramp, smooth_cut, smooth_intersection, smooth_union, tube, wave,
};
use super::skull::upper_cavity;
use bevy::math::Vec3;
use std::f32::consts::TAU;

/// Width of the fluid-filled gap between the skull and the brain.
pub(super) const GAP: f32 = 4.0;

/// Distances that describe the brain at one place.
pub(super) struct Brain {
    /// Distance to everything made of brain tissue.
    pub surface: f32,
    /// Distance to the white matter inside.
    pub white: f32,
}

/// Describes the brain at `p`; `q` is the same place mirrored to x >= 0.
pub(super) fn brain(p: Vec3, q: Vec3) -> Brain {
    let cerebrum = cerebrum(p, q);
    let cerebellum = cerebellum(q);
    let stem = stem(q);
    let surface = cerebrum.min(cerebellum).min(stem);
    let cut_out = -ventricles(q);
    let nuclei = nuclei(q);
    Brain {
        surface: surface.max(cut_out),
        // The cortex is three millimetres thick and the deep nuclei are grey, too.
        white: smooth_union(smooth_union(cerebrum + 3.0, cerebellum + 2.2, 1.0), stem, 4.0).max(-nuclei),
    }
}

/// Smooth outline of the cerebrum, without folds and in one piece.
fn cerebrum_hull(q: Vec3) -> f32 {
    // The tentorium separates the cerebrum from the cerebellum below.
    smooth_cut(upper_cavity(q) + GAP, cerebellum_hull(q) - 2.6, 4.0)
}

/// Cerebrum with its two hemispheres and all folds.
fn cerebrum(p: Vec3, q: Vec3) -> f32 {
    let hull = cerebrum_hull(q);
    if hull > 3.0 {
        return hull;
    }
    let bridge = ellipsoid(q, at(0.0, -12.0, 32.0), at(30.0, 30.0, 22.0));
    let fissure = smooth_intersection(q.x - 1.9, -bridge, 2.0);
    let hull = smooth_cut(hull, fissure, 5.0);
    let hull = smooth_cut(hull, sylvian_fissure(q, -hull), 3.5);
    let depth = -hull;
    if depth > 24.0 {
        return hull;
    }
    // Folds stand upright on the hull, so look up the pattern where this place would surface.
    let hemisphere = at(if p.x < 0.0 { -24.0 } else { 24.0 }, -10.0, 42.0);
    let outwards = (p - hemisphere).normalize_or_zero();
    let sulcus = sulcus(p + outwards * (0.8 * depth.max(0.0)), depth);
    // The deep brain has no folds: there the hull's distance is the distance to the bridge's rim.
    let sulcus = sulcus + 4.0 * ramp(4.0, -4.0, bridge);
    // A wide fillet makes the crowns of the gyri round.
    smooth_cut(hull, sulcus, 5.5)
}

/// Distance to the sulci, at the surface point `s` of a place `depth` below the surface.
fn sulcus(s: Vec3, depth: f32) -> f32 {
    let warp = at(noise(s / 19.0, 1), noise(s / 19.0, 2), noise(s / 19.0, 3));
    let u = (s + 8.5 * warp) / 29.0;
    // A gyroid: its zero surface winds through space with an even spacing, as the sulci do.
    let gyroid = wave(u.x) * wave(u.y + 0.25) + wave(u.y) * wave(u.z + 0.25) + wave(u.z) * wave(u.x + 0.25);
    // 29 mm / 2 pi turns the phase into millimetres. 1.3 is the gyroid's usual slope.
    let from_middle = gyroid.abs() * (29.0 / TAU / 1.3);
    let bottom = 14.0 + 4.0 * noise(s / 13.0, 4);
    let open = 1.2 + 0.7 * ramp(5.0, 0.0, depth);
    from_middle - open + 2.2 * ramp(bottom - 4.0, bottom, depth)
}

/// Deep cleft between the temporal lobe and the lobes above it.
fn sylvian_fissure(q: Vec3, depth: f32) -> f32 {
    let line = 27.0 - 0.33 * (q.y - 12.0);
    let from_sheet = (q.z - line + 2.0 * noise(q / 16.0, 5)).abs() * 0.95;
    let ends = (q.y - 50.0).max(-38.0 - q.y).max(30.0 - q.x);
    (from_sheet - 1.6).max(ends).max(depth - 20.0)
}

/// Outline of the cerebellum.
fn cerebellum_hull(q: Vec3) -> f32 {
    let lobe = ellipsoid(q, at(18.0, -52.0, 5.0), at(25.0, 28.5, 23.5));
    let vermis = ellipsoid(q, at(0.0, -50.0, 8.0), at(10.0, 26.0, 20.0));
    smooth_union(lobe, vermis, 6.0)
}

/// Cerebellum with its fine, parallel folds.
fn cerebellum(q: Vec3) -> f32 {
    let hull = cerebellum_hull(q);
    if !(-9.0..=3.0).contains(&hull) {
        return hull;
    }
    // Sheets fan out from the front, where the cerebellum joins the stem.
    let front = q - at(0.0, -14.0, 4.0);
    let fan = front.z / (front.y.abs() + 14.0) * 46.0 + 0.05 * q.x + 1.6 * noise(q / 14.0, 6);
    let from_sheet = (wave(fan / 11.0)).abs() * 1.9;
    let leaf = from_sheet - 0.75 + 1.8 * ramp(5.0, 9.0, -hull);
    smooth_cut(hull, leaf, 1.5)
}

/// Brain stem and spinal cord.
fn stem(q: Vec3) -> f32 {
    let trunk = tube(
        q,
        &[
            (at(0.0, -16.0, 30.0), 13.0),
            (at(0.0, -21.0, 10.0), 10.5),
            (at(0.0, -32.0, -14.0), 8.0),
            (at(0.0, -38.0, -34.0), 6.0),
            (at(0.0, -38.0, -140.0), 5.0),
        ],
    );
    let pons = ellipsoid(q, at(0.0, -15.0, 9.0), at(15.0, 10.5, 12.0));
    let peduncle = capsule(q, (at(4.0, -18.0, 7.0), 8.0), (at(18.0, -38.0, 6.0), 7.0));
    smooth_union(smooth_union(trunk, pons, 5.0), peduncle, 4.0)
}

/// Thalamus and basal ganglia.
fn nuclei(q: Vec3) -> f32 {
    let thalamus = ellipsoid(q, at(11.0, -16.0, 38.0), at(8.0, 14.0, 8.5));
    let putamen = ellipsoid(q, at(25.0, 3.0, 38.0), at(5.5, 17.0, 11.0));
    let caudate = ellipsoid(q, at(13.0, 14.0, 46.0), at(5.0, 11.0, 7.0));
    thalamus.min(putamen).min(caudate)
}

/// Distance to the fluid-filled ventricles.
pub(super) fn ventricles(q: Vec3) -> f32 {
    let lateral = tube(
        q,
        &[
            (at(13.0, 30.0, 48.0), 3.6),
            (at(8.0, 16.0, 54.0), 5.2),
            (at(10.0, -18.0, 57.0), 5.0),
            (at(18.0, -42.0, 50.0), 6.4),
            (at(29.0, -36.0, 34.0), 4.2),
            (at(31.0, -8.0, 20.0), 2.6),
        ],
    );
    let horn = capsule(q, (at(18.0, -42.0, 50.0), 6.0), (at(16.0, -62.0, 46.0), 2.6));
    let third = ellipsoid(q, at(0.0, -12.0, 38.0), at(2.2, 15.0, 11.0));
    let fourth = ellipsoid(q, at(0.0, -31.0, 6.0), at(6.0, 4.0, 11.0));
    smooth_union(lateral, horn, 3.0).min(third).min(fourth)
}
