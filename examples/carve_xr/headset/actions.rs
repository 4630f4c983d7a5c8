//! Controllers: OpenXR actions of both hands.

use bevy::prelude::*;
use bevy_mod_openxr::{
    action_binding::OxrSuggestActionBinding, action_set_attaching::OxrAttachActionSet,
    action_set_syncing::OxrSyncActionSet, resources::OxrInstance, session::OxrSession,
};
use bevy_mod_xr::spaces::{XrPrimaryReferenceSpace, XrSpace, XrSpaceLocationFlags};
use openxr::{Action, ActionSet, Path, Posef, Vector2f};

use super::{
    super::controls::{Controls, Side},
    bindings::{HANDS, Input, PROFILES},
};

/// Actions of both hands. They outlive sessions.
#[derive(Resource)]
pub struct Actions {
    set: ActionSet,
    aim: Action<Posef>,
    grip: Action<f32>,
    trigger: Action<f32>,
    stick: Action<Vector2f>,
    stick_pressed: Action<bool>,
    shape: Action<bool>,
    operation: Action<bool>,
    /// Left and right.
    hands: [Path; 2],
    /// Runtimes accept suggestions once.
    are_suggested: bool,
}

impl Actions {
    fn new(instance: &OxrInstance) -> openxr::Result<Self> {
        let [left, right] = HANDS.map(|hand| instance.string_to_path(hand));
        let hands = [left?, right?];
        let set = instance.create_action_set("carving", "Carving", 0)?;
        Ok(Self {
            aim: set.create_action("aim", "Hand", &hands)?,
            grip: set.create_action("grip", "Grab", &hands)?,
            trigger: set.create_action("trigger", "Carve", &hands)?,
            stick: set.create_action("stick", "Scale, turn", &hands)?,
            stick_pressed: set.create_action("stick_pressed", "Teleport", &hands)?,
            shape: set.create_action("shape", "Next shape", &hands)?,
            operation: set.create_action("operation", "Cut or keep", &hands)?,
            set,
            hands,
            are_suggested: false,
        })
    }

    fn path_of(&self, side: Side) -> Path {
        self.hands[side as usize]
    }

    /// Writes what a controller says; `None` if there is none.
    fn read(&self, session: &OxrSession, controls: &Controls) -> openxr::Result<Option<Controls>> {
        let hand = self.path_of(controls.side);
        if !self.aim.is_active(session, hand)? {
            return Ok(None);
        }
        let Vector2f { x, y } = self.stick.state(session, hand)?.current_state;
        Ok(Some(Controls {
            grip: self.grip.state(session, hand)?.current_state,
            trigger: self.trigger.state(session, hand)?.current_state,
            stick: Vec2::new(x, y),
            stick_pressed: self.stick_pressed.state(session, hand)?.current_state,
            shape: self.shape.state(session, hand)?.current_state,
            operation: self.operation.state(session, hand)?.current_state,
            ..Controls::new(controls.side)
        }))
    }
}

pub(super) fn create(instance: Res<OxrInstance>, mut commands: Commands) -> Result {
    commands.insert_resource(Actions::new(&instance)?);
    Ok(())
}

pub(super) fn suggest_bindings(
    mut actions: ResMut<Actions>,
    mut suggestions: MessageWriter<OxrSuggestActionBinding>,
) {
    if std::mem::replace(&mut actions.are_suggested, true) {
        return;
    }
    let raw = [
        (Input::Aim, actions.aim.as_raw()),
        (Input::Grip, actions.grip.as_raw()),
        (Input::Trigger, actions.trigger.as_raw()),
        (Input::Stick, actions.stick.as_raw()),
        (Input::StickPressed, actions.stick_pressed.as_raw()),
        (Input::Shape, actions.shape.as_raw()),
        (Input::Operation, actions.operation.as_raw()),
    ];
    for profile in &PROFILES {
        for (input, action) in raw {
            let bindings: Vec<_> = profile.paths_of(input).into_iter().map(Into::into).collect();
            if !bindings.is_empty() {
                let interaction_profile = profile.path.into();
                suggestions.write(OxrSuggestActionBinding { action, interaction_profile, bindings });
            }
        }
    }
}

pub(super) fn attach(actions: Res<Actions>, mut attached: MessageWriter<OxrAttachActionSet>) {
    attached.write(OxrAttachActionSet(actions.set.clone()));
}

/// Lets hands follow their controllers in a new session.
pub(super) fn locate_hands(
    actions: Res<Actions>,
    session: Res<OxrSession>,
    hands: Query<(Entity, &Controls)>,
    mut commands: Commands,
) -> Result {
    for (entity, controls) in &hands {
        let hand = actions.path_of(controls.side);
        commands.entity(entity).insert(session.create_action_space(
            &actions.aim,
            hand,
            Isometry3d::IDENTITY,
        )?);
    }
    Ok(())
}

/// Ends the spaces of a session before the session ends. OpenXR would end them too. But a space of the next session may
/// get the same handle, and the layer that checks calls refuses that.
pub(super) fn destroy_spaces(
    instance: Res<OxrInstance>,
    hands: Query<(Entity, &XrSpace), With<Controls>>,
    primary: Option<Res<XrPrimaryReferenceSpace>>,
    mut commands: Commands,
) -> Result {
    for (hand, space) in &hands {
        commands.entity(hand).remove::<XrSpace>();
        instance.destroy_space(*space)?;
    }
    if let Some(primary) = primary {
        instance.destroy_space(primary.0.0)?;
    }
    Ok(())
}

pub(super) fn sync(actions: Res<Actions>, mut synced: MessageWriter<OxrSyncActionSet>) {
    synced.write(OxrSyncActionSet(actions.set.clone()));
}

pub(super) fn read(
    actions: Res<Actions>,
    session: Res<OxrSession>,
    mut hands: Query<(&mut Controls, &XrSpaceLocationFlags)>,
) -> Result {
    for (mut controls, located) in &mut hands {
        let read = actions.read(&session, &controls)?;
        let is_tracked = read.is_some() && located.position_tracked && located.rotation_tracked;
        *controls = Controls { is_tracked, ..read.unwrap_or(Controls::new(controls.side)) };
    }
    Ok(())
}
