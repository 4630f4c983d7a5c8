//! Things follow the hands that hold them.

use bevy::{
    math::{DAffine3, DQuat},
    prelude::*,
};

use super::{
    grabbable::{Grabbable, HeldBy, MAX_HANDS},
    grasp::{Finger, Grasp},
    motion::{Similarity, limited},
    places::{Places, depth, place_in},
};

/// Distance of two hands below which they move nothing, world units. The noise of tracking would turn and scale.
const LEAST_DISTANCE: f64 = 0.001;

/// The hands that move a thing.
fn movers(held_by: Option<&HeldBy>) -> &[Entity] {
    let hands = held_by.map_or(&[][..], HeldBy::hands);
    &hands[..hands.len().min(MAX_HANDS)]
}

/// Places of hands in a space; `None` if one has no place, or if two are too near each other.
fn places_of(hands: &[Entity], space: Option<Entity>, places: &Places) -> Option<Vec<Similarity>> {
    if let [a, b] = hands {
        let [a, b] = [a, b].map(|&hand| place_in(hand, None, places));
        let at = |place: Option<DAffine3>| Some(place?.translation);
        if at(a)?.distance(at(b)?) < LEAST_DISTANCE {
            return None;
        }
    }
    hands.iter().map(|&hand| Similarity::of(&place_in(hand, space, places)?)).collect()
}

/// Moves things with the hands that hold them.
pub(super) fn follow_hands(
    mut transforms: Query<(&'static mut Transform, Option<&'static ChildOf>)>,
    mut things: Query<(&Grabbable, &HeldBy, &mut Grasp)>,
    held: Query<Entity, (With<Grabbable>, With<HeldBy>)>,
) {
    let mut order: Vec<_> = held.iter().collect();
    // A thing that hangs from another needs the new place of that.
    order.sort_by_cached_key(|&thing| depth(thing, &transforms.as_readonly()));
    for thing in order {
        let (Ok((grabbable, held_by, mut grasp)), Ok((start, parent))) =
            (things.get_mut(thing), transforms.get(thing))
        else {
            continue;
        };
        let parent = parent.map(ChildOf::parent);
        let hands = movers(Some(held_by));
        if hands.is_empty() || !grasp.is_by(hands, parent) {
            continue;
        }
        if grasp.latest != *start {
            grasp.go_on_from(start);
        }
        let Some(places) = places_of(hands, parent, &transforms.as_readonly()) else {
            continue;
        };
        let moved = grasp.motion(&places).map_or(grasp.start, |mut motion| {
            motion.scale = match grabbable.lock_scale {
                true => motion.scale.signum(),
                false => limited(motion.scale, grasp.start.scale, grabbable.min_scale, grabbable.max_scale),
            };
            if grabbable.lock_rotation {
                motion.rotation = DQuat::IDENTITY;
            }
            motion.apply(&grasp.start)
        });
        if !moved.is_finite() {
            continue;
        }
        grasp.latest = moved;
        if let Ok((mut transform, _)) = transforms.get_mut(thing) {
            transform.set_if_neq(moved);
        }
    }
}

/// Begins grabs anew where hands came or went. So nothing jumps.
pub(super) fn renew_grasps(
    mut things: Query<(Entity, Option<&HeldBy>, &mut Grasp), With<Grabbable>>,
    places: Places,
) {
    for (thing, held_by, mut grasp) in &mut things {
        let hands = movers(held_by);
        let Ok((transform, parent)) = places.get(thing) else {
            continue;
        };
        let parent = parent.map(ChildOf::parent);
        if grasp.is_by(hands, parent) {
            continue;
        }
        let now = places_of(hands, parent, &places).filter(|_| transform.is_finite()).unwrap_or_default();
        let fingers = hands.iter().zip(now).map(|(&hand, start)| Finger { hand, start, latest: start });
        *grasp = Grasp { fingers: fingers.collect(), parent, start: *transform, latest: *transform };
    }
}
