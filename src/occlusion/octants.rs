//! Octants of directions: how the octants of a grid lie in those of volume space (pure maths).

use bevy::math::{DMat3, DVec3};

/// Direction to the middle of an octant, not of unit length. Bit `a` of an octant's number is set on the positive
/// side of axis `a`.
pub(super) fn octant_center(octant: usize) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|axis| if octant >> axis & 1 == 1 { 1.0 } else { -1.0 }))
}

/// Shares of an octant's solid angle that lie in each octant of a frame. The octant is one of `axes`: columns of any
/// length, given in that frame.
pub(super) fn octant_shares(axes: DMat3, octant: usize) -> [f64; 8] {
    let signs = octant_center(octant);
    let cone = [0, 1, 2].map(|axis| signs[axis] * axes.col(axis));
    let whole = solid_angle(&cone);
    let shares = core::array::from_fn(|other| {
        let sides = DMat3::from_diagonal(octant_center(other));
        let inside = [0, 1, 2].iter().fold(cone.to_vec(), |cone, &axis| cut(&cone, sides.col(axis)));
        let share = solid_angle(&inside) / whole;
        // Rounding leaves a sliver of the octant in neighbouring octants.
        if share < 1e-6 { 0.0 } else { share }
    });
    let sum: f64 = shares.iter().sum();
    shares.map(|share| share / sum)
}

/// The part of a cone, given by its edges, on the positive side of a plane through its tip.
fn cut(cone: &[DVec3], normal: DVec3) -> Vec<DVec3> {
    let mut kept = Vec::new();
    for (k, &edge) in cone.iter().enumerate() {
        let next = cone[(k + 1) % cone.len()];
        let (here, there) = (edge.dot(normal), next.dot(normal));
        if here >= 0.0 {
            kept.push(edge);
        }
        if here * there < 0.0 {
            kept.push((next * here - edge * there) * here.signum());
        }
    }
    kept
}

/// The solid angle of a convex cone, given by its edges. It is the sum over the triangles that make up the cone (Van
/// Oosterom and Strackee 1983).
fn solid_angle(cone: &[DVec3]) -> f64 {
    let triangle = |pair: &[DVec3]| {
        let [a, b, c] = [cone[0], pair[0], pair[1]].map(DVec3::normalize);
        let product = a.dot(b.cross(c)).abs();
        2.0 * product.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
    };
    cone.get(1..).unwrap_or_default().windows(2).map(triangle).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::occlusion::fibonacci_direction;
    use bevy::math::DQuat;

    #[test]
    fn axes_in_another_order_have_octants_in_another_order() {
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z];
        let axes = DMat3::from_cols(-2.0 * x, z, 9.0 * y);
        let places = [1, 0, 5, 4, 3, 2, 7, 6];
        for (octant, place) in places.into_iter().enumerate() {
            let shares = octant_shares(axes, octant);
            assert_eq!(shares, core::array::from_fn(|other| f64::from(u8::from(other == place))));
        }
    }

    #[test]
    fn shares_are_those_of_directions() {
        const DIRECTIONS: u32 = 1 << 16;
        let sheared = DMat3::from_cols(DVec3::X, DVec3::new(0.3, 1.0, -0.2), DVec3::Z);
        let axes = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(0.4, -0.3, 0.5))) * sheared;
        let mut counts = [[0.0; 8]; 8];
        for k in 0..DIRECTIONS {
            let direction = fibonacci_direction(k, DIRECTIONS);
            let number = |v: DVec3| v.cmpgt(DVec3::ZERO).bitmask() as usize;
            counts[number(axes.inverse() * direction)][number(direction)] += 1.0;
        }
        for (octant, counts) in counts.iter().enumerate() {
            let all: f64 = counts.iter().sum();
            for (share, count) in octant_shares(axes, octant).iter().zip(counts) {
                // Some hundred of the 8192 directions lie along the edges, on either side.
                assert!((share - count / all).abs() < 2e-3, "{share}, counted {}", count / all);
            }
        }
    }
}
