//! How far a thing is from a hand.

use bevy::{camera::primitives::Aabb, ecs::system::SystemParam, math::DVec3, prelude::*};

use super::{
    grabbable::Grabbable,
    hand::Hand,
    places::{Places, inverse, place_in},
};
use crate::clip::ClipMesh;

/// The boxes of things.
#[derive(SystemParam)]
pub(super) struct Boxes<'w, 's> {
    boxes: Query<'w, 's, &'static Aabb>,
    children: Query<'w, 's, &'static Children>,
    others: Query<'w, 's, (), Or<(With<ClipMesh>, With<Grabbable>, With<Hand>)>>,
}

impl Boxes<'_, '_> {
    /// Distance of a point to a thing's nearest box, world units, and the content of that box; `None` if it has no place.
    pub fn distance(&self, point: DVec3, thing: Entity, places: &Places) -> Option<[f64; 2]> {
        let parts = self.parts(thing);
        let boxes = parts.into_iter().filter_map(|part| {
            let bounds = self.boxes.get(part).ok()?;
            let world_from_box = place_in(part, None, places)?;
            let (center, half) = (bounds.center.as_dvec3(), bounds.half_extents.as_dvec3());
            let inside = inverse(&world_from_box)?.transform_point3(point) - center;
            let nearest = world_from_box.transform_point3(center + inside.max(-half).min(half));
            let content = 8.0 * half.element_product() * world_from_box.matrix3.determinant().abs();
            Some([nearest.distance(point), content])
        });
        let nearest = boxes.min_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        nearest.or_else(|| Some([place_in(thing, None, places)?.translation.distance(point), 0.0]))
    }

    /// The thing and its descendants, up to carvers, hands and other things.
    fn parts(&self, thing: Entity) -> Vec<Entity> {
        let mut parts = vec![thing];
        let mut next = 0;
        while let Some(&part) = parts.get(next) {
            let children = self.children.get(part).into_iter().flat_map(|children| children.iter());
            parts.extend(children.filter(|child| !self.others.contains(*child)));
            next += 1;
        }
        parts
    }
}
