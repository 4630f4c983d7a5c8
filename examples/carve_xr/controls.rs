//! The controls of a hand, from any device, and what they do.

use bevy::prelude::*;
use bevy_contextual_ao::prelude::*;

/// Which hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    Left,
    Right,
}

/// What a hand does, in this frame. A headset or a mouse writes it and the hand's [`Transform`], before [`Update`].
#[derive(Component, Clone, Copy, Debug)]
#[require(Hand)]
pub struct Controls {
    pub side: Side,
    /// How far the hand is closed, 0 to 1.
    pub grip: f32,
    /// How far the trigger is pulled, 0 to 1.
    pub trigger: f32,
    /// The thumbstick: right and up, -1 to 1.
    pub stick: Vec2,
    /// Whether the thumbstick is pressed down.
    pub stick_pressed: bool,
    /// Whether the button for the next shape is pressed.
    pub shape: bool,
    /// Whether the button for cutting or keeping is pressed.
    pub operation: bool,
    /// Where the hand points (negative z), relative to the hand.
    pub aim: Isometry3d,
    /// The tip of the index finger, relative to the hand, if fingers are tracked.
    pub finger: Option<Vec3>,
    /// Whether the device knows where the hand is.
    pub is_tracked: bool,
}

impl Controls {
    /// A hand of which nothing is known yet.
    pub fn new(side: Side) -> Self {
        Self {
            side,
            grip: 0.0,
            trigger: 0.0,
            stick: Vec2::ZERO,
            stick_pressed: false,
            shape: false,
            operation: false,
            aim: Isometry3d::IDENTITY,
            finger: None,
            is_tracked: false,
        }
    }
}
