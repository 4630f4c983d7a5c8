//! Places of entities as their [`Transform`]s of this moment give them, before Bevy propagates these.

use bevy::{math::DAffine3, prelude::*};

/// The transforms that places follow from.
pub(super) type Places<'w, 's> = Query<'w, 's, (&'static Transform, Option<&'static ChildOf>)>;

/// The space of an entity in the space of another, or in the world; `None` if there is no such place.
///
/// It is found below the nearest common ancestor. So a rig that moves as a whole keeps it bit for bit.
pub(super) fn place_in(entity: Entity, space: Option<Entity>, places: &Places) -> Option<DAffine3> {
    let place = match space {
        None => in_world(entity, places),
        Some(space) => {
            let common = ancestors(entity, places).find_map(|(ancestor, from)| {
                ancestors(space, places).find(|(other, _)| *other == ancestor).map(|(_, to)| (from, to))
            });
            let (from, to) = common.unwrap_or_else(|| (in_world(entity, places), in_world(space, places)));
            inverse(&to)? * from
        }
    };
    place.is_finite().then_some(place)
}

/// The inverse, unless the transform is collapsed or not finite.
pub(super) fn inverse(affine: &DAffine3) -> Option<DAffine3> {
    (affine.is_finite() && affine.matrix3.determinant().is_normal()).then(|| affine.inverse())
}

/// Number of an entity's ancestors.
pub(super) fn depth(entity: Entity, places: &Places) -> usize {
    ancestors(entity, places).count()
}

/// Whether an entity is another, or hangs from it.
pub(super) fn hangs_from(entity: Entity, other: Entity, places: &Places) -> bool {
    ancestors(entity, places).any(|(ancestor, _)| ancestor == other)
}

/// The entity and its ancestors, each with the transform from the entity's space to the ancestor's space.
fn ancestors(entity: Entity, places: &Places) -> impl Iterator<Item = (Entity, DAffine3)> {
    core::iter::successors(Some((entity, DAffine3::IDENTITY)), |&(entity, place)| {
        let (local, parent) = places.get(entity).ok()?;
        Some((parent?.parent(), double(local) * place))
    })
}

fn in_world(entity: Entity, places: &Places) -> DAffine3 {
    let (root, place) = ancestors(entity, places).last().unwrap_or((entity, DAffine3::IDENTITY));
    places.get(root).map_or(place, |(local, _)| double(local) * place)
}

fn double(local: &Transform) -> DAffine3 {
    if !local.is_finite() || local.rotation.length_squared() == 0.0 {
        return DAffine3::NAN;
    }
    DAffine3::from_scale_rotation_translation(
        local.scale.as_dvec3(),
        local.rotation.as_dquat().normalize(),
        local.translation.as_dvec3(),
    )
}
