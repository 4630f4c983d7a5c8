//! Boxes in the world, and which of them may share space.

use bevy::{math::Affine3A, prelude::*};

/// A box in the world: the image of the unit cube [0, 1]³.
#[derive(Clone, Copy, Debug)]
pub(in crate::drawing) struct WorldBox(pub Affine3A);

impl WorldBox {
    /// The box around a centre, in a space of its own.
    pub fn around(world_from_local: Affine3A, center: Vec3, half_extents: Vec3) -> Self {
        let local = Affine3A::from_scale_rotation_translation(
            2.0 * half_extents,
            Quat::IDENTITY,
            center - half_extents,
        );
        Self(world_from_local * local)
    }

    pub fn corners(&self) -> [Vec3; 8] {
        core::array::from_fn(|k| {
            let corner = [0, 1, 2].map(|axis| ((k >> axis) & 1) as f32);
            self.0.transform_point3(Vec3::from_array(corner))
        })
    }

    /// Whether two boxes may share space. Boxes beside each other along no axis of either may be said to share some.
    pub fn may_meet(&self, other: &Self) -> bool {
        !self.lies_beside(other) && !other.lies_beside(self)
    }

    /// Whether another box lies beyond one of this box's faces. A flat box has no such faces.
    fn lies_beside(&self, other: &Self) -> bool {
        let into_cube = self.0.inverse();
        if !into_cube.is_finite() {
            return false;
        }
        let corners = other.corners().map(|corner| into_cube.transform_point3(corner));
        let low = corners.into_iter().fold(Vec3::INFINITY, Vec3::min);
        let high = corners.into_iter().fold(Vec3::NEG_INFINITY, Vec3::max);
        low.cmpge(Vec3::ONE).any() || high.cmple(Vec3::ZERO).any()
    }
}

/// Groups of things whose boxes share space, directly or through others of the group. Each is a list of indices, and has at
/// least one.
pub(in crate::drawing) fn groups_of(boxes: &[WorldBox]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (index, own) in boxes.iter().enumerate() {
        let meets = |group: &Vec<usize>| group.iter().any(|other| own.may_meet(&boxes[*other]));
        let (met, mut rest): (Vec<_>, Vec<_>) = groups.into_iter().partition(meets);
        let mut joined: Vec<usize> = met.into_iter().flatten().collect();
        joined.push(index);
        rest.push(joined);
        groups = rest;
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(center: Vec3, turned_degrees: f32) -> WorldBox {
        let turned = Quat::from_rotation_y(turned_degrees.to_radians());
        let place = Affine3A::from_rotation_translation(turned, center);
        WorldBox::around(place, Vec3::ZERO, Vec3::splat(0.5))
    }

    #[test]
    fn boxes_that_touch_share_no_space_and_a_turned_corner_does() {
        let origin = cube(Vec3::ZERO, 0.0);
        assert!(!origin.may_meet(&cube(Vec3::X, 0.0)), "faces touch");
        assert!(origin.may_meet(&cube(0.99 * Vec3::X, 0.0)));
        // The half diagonal of a turned cube is 0.707.
        assert!(origin.may_meet(&cube(1.2 * Vec3::X, 45.0)));
        assert!(!origin.may_meet(&cube(1.21 * Vec3::X, 45.0)));
    }

    #[test]
    fn a_flat_box_meets_the_boxes_that_it_cuts() {
        let pane = WorldBox::around(Affine3A::IDENTITY, Vec3::ZERO, Vec3::new(2.0, 2.0, 0.0));
        assert!(pane.may_meet(&cube(Vec3::X, 30.0)));
        assert!(!pane.may_meet(&cube(0.6 * Vec3::Z, 0.0)));
        assert!(!cube(3.0 * Vec3::X, 0.0).may_meet(&pane));
    }

    #[test]
    fn groups_join_through_a_box_between_whatever_the_order_is() {
        let [left, middle, right, away] = [0.0, 0.9, 1.8, 9.0].map(|x| cube(x * Vec3::X, 0.0));
        let mut groups = groups_of(&[left, right, away, middle]);
        groups.iter_mut().for_each(|group| group.sort_unstable());
        groups.sort();
        assert_eq!(groups, [vec![0, 1, 3], vec![2]]);
    }
}
