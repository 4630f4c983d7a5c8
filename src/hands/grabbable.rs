//! What hands grab, who holds what, and the events.

use bevy::prelude::*;

use super::{grasp::Grasp, hand::Hand};

/// Hands that move a thing. Another one does not grab it.
pub(super) const MAX_HANDS: usize = 2;

/// A thing that hands grab: a volume, a carver, or anything with a [`Transform`], also a child.
///
/// A hand that closes takes the nearest thing within its [`Hand::reach`]; of several that it is in, the smallest. What counts
/// is the boxes ([`Aabb`](bevy::camera::primitives::Aabb)) of the thing and of its children, without carvers and things of their own. A
/// thing without a box is grabbed at its origin.
///
/// A thing in one hand moves as if it were the hand's child. In two hands both places where it was grabbed stay under the hands.
/// So it moves, turns and grows; about the line between the hands it turns by the mean of both hands. Up to 360 degrees between
/// the hands there is no jump. Its pose follows from the poses at the grab and now, so nothing adds up. A parent with an uneven
/// scale is allowed; then places stay under hands only approximately.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(Transform, Grasp)]
pub struct Grabbable {
    /// Least [`Transform::scale`] (its largest component) that hands give the thing.
    pub min_scale: f32,
    /// Largest [`Transform::scale`] (its largest component) that hands give the thing. At a limit the middle between the
    /// hands stays where it is in the thing.
    pub max_scale: f32,
    /// Whether hands leave the thing's size alone.
    pub lock_scale: bool,
    /// Whether hands leave the thing's rotation alone.
    pub lock_rotation: bool,
}

impl Default for Grabbable {
    /// From a hundredth to a hundred times life-size.
    fn default() -> Self {
        Self { min_scale: 0.01, max_scale: 100.0, lock_scale: false, lock_rotation: false }
    }
}

/// The thing that a hand holds. Inserting it on a [`Hand`] grabs a [`Grabbable`], removing it lets go.
///
/// A hand keeps a thing that the app put into it until it opens; an open one closes before.
// Without `Clone`, so that a clone of a hand holds nothing.
#[derive(Component, Debug, PartialEq, Eq)]
#[relationship(relationship_target = HeldBy)]
pub struct Holds(pub Entity);

/// The hands that hold a thing, in the order in which they grabbed. The first two move it.
#[derive(Component, Clone, Debug, Default, PartialEq, Eq)]
#[relationship_target(relationship = Holds)]
pub struct HeldBy(Vec<Entity>);

impl HeldBy {
    /// The hands.
    pub fn hands(&self) -> &[Entity] {
        &self.0
    }
}

/// Triggered on a thing that a hand grabbed.
#[derive(EntityEvent, Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grabbed {
    /// The thing.
    pub entity: Entity,
    /// The hand.
    pub hand: Entity,
}

/// Triggered on a thing that a hand let go, also where hand or thing despawned.
#[derive(EntityEvent, Clone, Copy, Debug, PartialEq, Eq)]
pub struct Released {
    /// The thing.
    pub entity: Entity,
    /// The hand.
    pub hand: Entity,
}

pub(super) fn announce_grab(grab: On<Insert, Holds>, hands: Query<&Holds>, mut commands: Commands) {
    if let Ok(holds) = hands.get(grab.entity) {
        commands.trigger(Grabbed { entity: holds.0, hand: grab.entity });
    }
}

pub(super) fn announce_release(release: On<Discard, Holds>, hands: Query<&Holds>, mut commands: Commands) {
    if let Ok(holds) = hands.get(release.entity) {
        commands.trigger(Released { entity: holds.0, hand: release.entity });
    }
}

/// An entity that is no hand any more holds nothing.
pub(super) fn let_go_without_hand(hand: On<Remove, Hand>, mut commands: Commands) {
    commands.entity(hand.entity).try_remove::<Holds>();
}

/// A thing that is not grabbable any more is held by no hand.
pub(super) fn let_go_of_thing(thing: On<Remove, Grabbable>, mut commands: Commands) {
    commands.entity(thing.entity).try_remove::<(HeldBy, Grasp)>();
}
