//! Poses of entities relative to each other, free of the rounding of their places in the world.
//!
//! A rig that moves as a whole keeps these poses bit for bit, at any distance from the origin. A pose depends
//! on the present transforms alone, never on earlier transforms.

use bevy::{
    ecs::system::SystemParam,
    math::{DAffine3, DMat3},
    prelude::*,
};

/// Computes poses between entities.
#[derive(SystemParam)]
pub(crate) struct RelativePoses<'w, 's> {
    globals: Query<'w, 's, &'static GlobalTransform>,
    locals: Query<'w, 's, (&'static Transform, Option<&'static ChildOf>)>,
}

impl RelativePoses<'_, '_> {
    /// Transform from the space of `from` to the space of `to`; `None` if either has no place or is collapsed.
    pub fn between(&self, from: Entity, to: Entity) -> Option<DAffine3> {
        let [world_from, world_to] =
            [self.globals.get(from).ok()?, self.globals.get(to).ok()?].map(|global| double(&global.affine()));
        let by_world = world_to.inverse() * world_from;
        let by_ancestor = self.by_common_ancestor(from, to);
        let pose = by_ancestor.filter(|pose| is_rounding(world_from, world_to * *pose)).unwrap_or(by_world);
        (pose.is_finite() && pose.matrix3.determinant() != 0.0).then_some(pose)
    }

    /// The pose by the transforms below the nearest common ancestor; `None` without a common ancestor.
    fn by_common_ancestor(&self, from: Entity, to: Entity) -> Option<DAffine3> {
        self.ancestors(from).find_map(|(ancestor, ancestor_from)| {
            let (_, ancestor_to) = self.ancestors(to).find(|(other, _)| *other == ancestor)?;
            Some(ancestor_to.inverse() * ancestor_from)
        })
    }

    /// The entity and its ancestors, each with the transform from the entity's space to the ancestor's space.
    fn ancestors(&self, entity: Entity) -> impl Iterator<Item = (Entity, DAffine3)> {
        core::iter::successors(Some((entity, DAffine3::IDENTITY)), |&(entity, pose)| {
            let (local, parent) = self.locals.get(entity).ok()?;
            Some((parent?.parent(), double(&local.compute_affine()) * pose))
        })
    }
}

/// The transform to the world of an entity, unless it is collapsed or not finite. Rendering inverts it in single
/// precision, so single precision decides.
pub(crate) fn placed(transform: &GlobalTransform) -> Option<DAffine3> {
    let affine = transform.affine();
    let determinant = affine.matrix3.determinant();
    (affine.is_finite() && determinant != 0.0 && determinant.is_finite()).then(|| double(&affine))
}

fn double(affine: &bevy::math::Affine3A) -> DAffine3 {
    DAffine3 { matrix3: affine.matrix3.as_dmat3(), translation: affine.translation.as_dvec3() }
}

/// Whether two transforms to the world differ by no more than rounding. An app may move entities by its own
/// rules, so global transforms need not follow from local transforms.
fn is_rounding(a: DAffine3, b: DAffine3) -> bool {
    // Single precision rounds by 6e-8 of a number; some 100 roundings add up in a deep hierarchy.
    const SHARE: f64 = 1e-5;
    let size = |m: DMat3| m.x_axis.abs().max(m.y_axis.abs()).max(m.z_axis.abs()).max_element();
    let (far, size_a) = (a.translation.abs().max_element(), size(a.matrix3));
    size(a.matrix3 - b.matrix3) <= SHARE * size_a
        && (a.translation - b.translation).abs().max_element() <= SHARE * (far + size_a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::ecs::system::RunSystemOnce;

    /// Pose of a rig's grandchild relative to another child, with the rig at `root`.
    fn pose_in(root: Transform, has_propagated: bool) -> DAffine3 {
        let mut app = App::new();
        app.add_plugins(TransformPlugin);
        let world = app.world_mut();
        let root = world.spawn(root).id();
        let arm = Transform::from_xyz(0.3, -0.1, 0.2).with_rotation(Quat::from_rotation_x(0.4));
        let arm = world.spawn((arm, ChildOf(root))).id();
        let hand = world.spawn((Transform::from_xyz(0.01, 0.02, 0.03), ChildOf(arm))).id();
        let head = world.spawn((Transform::from_xyz(0.1, 0.2, 0.3), ChildOf(root))).id();
        app.update();
        if !has_propagated {
            let moved = GlobalTransform::from_xyz(1.0, 2.0, 3.0);
            app.world_mut().entity_mut(hand).insert(moved);
        }
        let between = move |poses: RelativePoses| poses.between(hand, head);
        app.world_mut().run_system_once(between).expect("it runs").expect("both have a place")
    }

    #[test]
    fn a_rig_that_moves_keeps_its_poses_bit_for_bit() {
        let at_rest = pose_in(Transform::IDENTITY, true);
        let turned = Transform::from_xyz(12.3, 4.5, -67.8).with_rotation(Quat::from_rotation_y(2.1));
        for root in [turned, Transform::from_xyz(1234.5, 0.1, 77.7), turned.with_scale(Vec3::splat(1.7))] {
            assert_eq!(pose_in(root, true), at_rest);
        }
    }

    #[test]
    fn global_transforms_that_an_app_sets_itself_count() {
        let found = pose_in(Transform::from_xyz(5.0, 0.0, 0.0), false);
        assert!(found.translation.abs_diff_eq(bevy::math::DVec3::new(-4.1, 1.8, 2.7), 1e-5), "{found}");
    }
}
