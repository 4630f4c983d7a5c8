//! Hands close and open.

use bevy::prelude::*;

use super::{
    grabbable::{Grabbable, HeldBy, Holds, MAX_HANDS},
    hand::{Hand, HandState},
    places::{Places, hangs_from, place_in},
    reach::Boxes,
};

/// Lets open hands let go, and hands that close grab.
pub(super) fn open_and_close(
    mut commands: Commands,
    hands: Query<(Entity, &Hand, &HandState, Option<&Holds>)>,
    things: Query<(Entity, Option<&HeldBy>), With<Grabbable>>,
    boxes: Boxes,
    places: Places,
) {
    // Hands that grabbed in this frame.
    let mut grabbed: Vec<Entity> = Vec::new();
    for (entity, hand, state, holds) in &hands {
        if holds.is_some() && state.opens {
            commands.entity(entity).try_remove::<Holds>();
        }
        if !state.closes || holds.is_some() {
            continue;
        }
        let Some(point) = place_in(entity, None, &places).map(|place| place.translation) else {
            continue;
        };
        let reach = f64::from(hand.reach.max(0.0));
        let within_reach = things.iter().filter_map(|(thing, held_by)| {
            let before = held_by.map_or(0, |held_by| held_by.hands().len());
            let holders = before + grabbed.iter().filter(|other| **other == thing).count();
            let is_own = hangs_from(thing, entity, &places) || hangs_from(entity, thing, &places);
            let [distance, content] =
                boxes.distance(point, thing, &places).filter(|_| holders < MAX_HANDS && !is_own)?;
            (distance <= reach).then_some((thing, distance, content))
        });
        let nearest = within_reach.min_by(|a, b| a.1.total_cmp(&b.1).then(a.2.total_cmp(&b.2)));
        if let Some((thing, ..)) = nearest {
            grabbed.push(thing);
            commands.entity(entity).try_insert(Holds(thing));
        }
    }
}
