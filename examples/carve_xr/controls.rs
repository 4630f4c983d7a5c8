//! The controls of a hand, from any device, and what they do.

use bevy::prelude::*;
use bevy_contextual_ao::prelude::*;

/// Deflection of a thumbstick that counts as none: sticks do not rest quite in the middle.
const DEAD_ZONE: f32 = 0.2;

pub struct ControlsPlugin;

impl Plugin for ControlsPlugin {
    fn build(&self, app: &mut App) {
        app.configure_sets(Update, (PanelPointing, ControlSystems).chain())
            .add_systems(Update, obey.in_set(ControlSystems));
    }
}

/// What hands do in a frame, in [`Update`].
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub struct ControlSystems;

/// Where hands point at the panel: it says what their triggers are for ([`TriggerUse`]).
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub struct PanelPointing;

/// Which hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    Left,
    Right,
}

/// What a hand does, in this frame. A headset or a mouse writes it and the hand's [`Transform`], before [`Update`].
#[derive(Component, Clone, Copy, Debug)]
#[require(Hand, TriggerUse, Buttons)]
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

    /// How fast the hand's carver grows, -1 to 1. A stick that is pressed down teleports, one that is pushed aside turns.
    fn scaling(&self) -> f32 {
        let is_free = !self.stick_pressed && self.stick.y.abs() > self.stick.x.abs();
        if is_free { beyond_dead_zone(self.stick.y) } else { 0.0 }
    }
}

/// What the trigger of a hand is for. A pull stays what it was when it began.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TriggerUse {
    #[default]
    Carving,
    Panel,
}

impl TriggerUse {
    /// The use in this frame, given whether the hand points at the panel and whether the trigger is pulled.
    pub fn next(self, points_at_panel: bool, is_pulled: bool) -> Self {
        match (is_pulled, points_at_panel) {
            (true, _) => self,
            (false, true) => Self::Panel,
            (false, false) => Self::Carving,
        }
    }
}

/// Asks to leave a copy of a hand's carver in the volume, where it cut last.
#[derive(EntityEvent, Clone, Copy, Debug)]
pub struct LeaveHere {
    /// The hand.
    pub entity: Entity,
}

/// A hand's buttons in the previous frame.
#[derive(Component, Clone, Copy, Debug, Default)]
struct Buttons {
    shape: bool,
    operation: bool,
    is_closed: bool,
    /// Whether this closing of the hand left its carver. It grabs nothing then.
    leaves: bool,
}

/// Whether a grip or a trigger is pressed, given whether it was. The thresholds are those of [`Hand`].
pub fn is_pressed(input: f32, was: bool) -> bool {
    let hand = Hand::default();
    if was { input > hand.release_at } else { input >= hand.press_at }
}

/// Deflection beyond the dead zone, -1 to 1.
pub fn beyond_dead_zone(deflection: f32) -> f32 {
    let beyond = (deflection.abs().max(DEAD_ZONE) - DEAD_ZONE) / (1.0 - DEAD_ZONE);
    beyond.min(1.0).copysign(deflection)
}

/// Passes controls on to the hands. A hand that is not tracked does nothing.
fn obey(mut commands: Commands, mut hands: Query<(Entity, &Controls, &TriggerUse, &mut Buttons, &mut Hand)>) {
    for (entity, controls, &trigger_use, mut before, mut hand) in &mut hands {
        let controls = if controls.is_tracked { *controls } else { Controls::new(controls.side) };
        let carves = trigger_use == TriggerUse::Carving;
        let is_closed = is_pressed(controls.grip, before.is_closed);
        let closes = is_closed && !before.is_closed;
        let leaves = is_closed && (before.leaves || closes && carves && hand.trigger >= hand.press_at);
        if leaves && closes {
            commands.trigger(LeaveHere { entity });
        }
        if controls.shape && !before.shape {
            commands.trigger(ChangeShape { entity, steps: 1 });
        }
        if controls.operation && !before.operation {
            commands.trigger(ToggleOperation { entity });
        }
        *before = Buttons { shape: controls.shape, operation: controls.operation, is_closed, leaves };
        hand.grip = if leaves { 0.0 } else { controls.grip };
        hand.trigger = if carves { controls.trigger } else { 0.0 };
        hand.scaling = controls.scaling();
    }
}
