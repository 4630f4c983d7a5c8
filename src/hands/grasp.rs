//! What a grab keeps: the poses of hands and thing when it began.

use bevy::prelude::*;

use super::motion::{Motion, Similarity};

/// A hand in a grasp. Places are in the space of the thing's parent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Finger {
    pub hand: Entity,
    /// Place at the grab.
    pub start: Similarity,
    /// The latest place. A rotation has two quaternions; that of the next frame is the one nearer to this one.
    pub latest: Similarity,
}

/// The grab of a thing, by one hand or two. It begins anew when a hand comes or goes, and when others move
/// the thing.
#[derive(Component, Clone, Debug, Default)]
#[component(clone_behavior = Ignore)]
pub(super) struct Grasp {
    /// The hands; none if nothing holds the thing, or as long as a place is not valid.
    pub fingers: Vec<Finger>,
    /// The thing's parent.
    pub parent: Option<Entity>,
    /// The thing at the grab.
    pub start: Transform,
    /// The thing as the hands left it.
    pub latest: Transform,
}

impl Grasp {
    /// Whether the grab is by these hands, under this parent.
    pub fn is_by(&self, hands: &[Entity], parent: Option<Entity>) -> bool {
        self.fingers.iter().map(|finger| finger.hand).eq(hands.iter().copied())
            && (self.fingers.is_empty() || self.parent == parent)
    }

    /// Goes on from a thing that others moved, and from the hands as they were when it was left.
    pub fn go_on_from(&mut self, thing: &Transform) {
        for finger in &mut self.fingers {
            finger.start = finger.latest;
        }
        (self.start, self.latest) = (*thing, *thing);
    }

    /// The motion since the grab; `None` if there is none.
    pub fn motion(&mut self, places: &[Similarity]) -> Option<Motion> {
        let is_back = |(finger, place): (&Finger, &Similarity)| {
            finger.start == *place || finger.start == Similarity { rotation: -place.rotation, ..*place }
        };
        // Hands that are where they were bring the thing back, to the bit.
        if self.fingers.iter().zip(places).all(is_back) {
            for finger in &mut self.fingers {
                finger.latest = finger.start;
            }
            return None;
        }
        let mut now = places.to_vec();
        for (finger, place) in self.fingers.iter_mut().zip(&mut now) {
            if place.rotation.dot(finger.latest.rotation) < 0.0 {
                place.rotation = -place.rotation;
            }
            finger.latest = *place;
        }
        match (self.fingers.as_slice(), now.as_slice()) {
            ([finger], [now]) => Some(Motion::of_one(&finger.start, now)),
            ([a, b], [now_a, now_b]) => Motion::of_two([&a.start, &b.start], [now_a, now_b]),
            _ => None,
        }
    }
}
