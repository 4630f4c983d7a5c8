//! Signed distances (negative inside, millimetres) and hash noise that model the phantom.
//!
//! Only arithmetic and square roots are used. IEEE 754 specifies both exactly, so every machine generates
//! the same head. The library functions `sin` or `exp` do not promise this.

use bevy::math::{IVec3, Vec2, Vec3};

/// Short for [`Vec3::new`], to keep the many landmark positions readable.
pub(super) const fn at(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

/// Approximate distance to an ellipsoid; exact for a sphere and near the surface.
pub(super) fn ellipsoid(p: Vec3, centre: Vec3, radii: Vec3) -> f32 {
    let v = (p - centre) / radii;
    let gradient = (v / radii).length();
    if gradient < 1e-6 {
        // At the very centre the quotient below is undefined.
        return -radii.min_element();
    }
    let k = v.length();
    k * (k - 1.0) / gradient
}

/// Distance to an ellipse around the z axis, for shapes that are extruded along z.
pub(super) fn ellipse(p: Vec2, radii: Vec2) -> f32 {
    let v = p / radii;
    let gradient = (v / radii).length();
    if gradient < 1e-6 {
        return -radii.min_element();
    }
    let k = v.length();
    k * (k - 1.0) / gradient
}

/// Distance to a sphere.
pub(super) fn sphere(p: Vec3, centre: Vec3, radius: f32) -> f32 {
    p.distance(centre) - radius
}

/// Distance to a capsule whose radius changes from `start.1` to `end.1`.
pub(super) fn capsule(p: Vec3, start: (Vec3, f32), end: (Vec3, f32)) -> f32 {
    let axis = end.0 - start.0;
    let t = ((p - start.0).dot(axis) / axis.length_squared().max(1e-6)).clamp(0.0, 1.0);
    (p - start.0 - axis * t).length() - (start.1 + (end.1 - start.1) * t)
}

/// Distance to the outline of a smooth tube through `points` of (position, radius).
pub(super) fn tube(p: Vec3, points: &[(Vec3, f32)]) -> f32 {
    points.windows(2).map(|pair| capsule(p, pair[0], pair[1])).fold(f32::MAX, f32::min)
}

/// Union whose crease is filled with a fillet of about `k` millimetres.
pub(super) fn smooth_union(a: f32, b: f32, k: f32) -> f32 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * k * 0.25
}

/// Intersection with a rounded edge of about `k` millimetres.
pub(super) fn smooth_intersection(a: f32, b: f32, k: f32) -> f32 {
    -smooth_union(-a, -b, k)
}

/// `a` without `cut`, with a rounded edge of about `k` millimetres.
pub(super) fn smooth_cut(a: f32, cut: f32, k: f32) -> f32 {
    smooth_intersection(a, -cut, k)
}

/// Periodic wave like `sin(2 pi t)`, made of parabolas.
pub(super) fn wave(t: f32) -> f32 {
    let f = t - t.floor();
    if f < 0.5 { 16.0 * f * (0.5 - f) } else { -16.0 * (f - 0.5) * (1.0 - f) }
}

/// Smooth step from 0 at `low` to 1 at `high`.
pub(super) fn ramp(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Well mixed 32 bits from `x` (the finalizer of MurmurHash3).
pub(super) const fn hash(x: u32) -> u32 {
    let x = (x ^ (x >> 16)).wrapping_mul(0x85eb_ca6b);
    let x = (x ^ (x >> 13)).wrapping_mul(0xc2b2_ae35);
    x ^ (x >> 16)
}

/// Maps hash bits to -1..1.
pub(super) fn signed_unit(bits: u32) -> f32 {
    // 24 bits are exact in an f32.
    (bits >> 8) as f32 / 8_388_608.0 - 1.0
}

/// Smooth value noise in -1..1 with features one unit of `p` wide.
pub(super) fn noise(p: Vec3, seed: u32) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let f = f * f * (Vec3::splat(3.0) - 2.0 * f);
    let cell: IVec3 = cell.as_ivec3();
    let corner = |dx: i32, dy: i32, dz: i32| {
        let h = (cell.x + dx) as u32;
        let h = hash(h.wrapping_mul(0x9e37_79b1) ^ seed);
        let h = h ^ ((cell.y + dy) as u32).wrapping_mul(0x85eb_ca77);
        signed_unit(hash(h.wrapping_add(((cell.z + dz) as u32).wrapping_mul(0xc2b2_ae3d))))
    };
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let row = |dy, dz| mix(corner(0, dy, dz), corner(1, dy, dz), f.x);
    let plane = |dz| mix(row(0, dz), row(1, dz), f.y);
    mix(plane(0), plane(1), f.z)
}
