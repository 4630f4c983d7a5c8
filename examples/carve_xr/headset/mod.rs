//! Hands and session of an OpenXR headset. Without a runtime none of it runs.
//!
//! `actions` (controllers) and `fingers` (hands without controllers) write [`Controls`](super::controls::Controls) and the
//! poses of hands; `passthrough` shows the room.

mod actions;
mod bindings;
mod fingers;
mod passthrough;

use bevy::prelude::*;
use bevy_mod_openxr::{
    action_binding::OxrSendActionBindings, action_set_syncing::OxrActionSetSyncSet, openxr_session_available,
    openxr_session_running, resources::OxrSessionConfig,
};
use bevy_mod_xr::{
    session::{XrPreDestroySession, XrSessionCreated},
    spaces::XrSpaceSyncSet,
};
use openxr::EnvironmentBlendMode;

pub use passthrough::Passthrough;

/// Reads controllers and tracked hands, before [`Update`].
pub struct HeadsetPlugin;

impl Plugin for HeadsetPlugin {
    fn build(&self, app: &mut App) {
        if let Some(mut session) = app.world_mut().get_resource_mut::<OxrSessionConfig>() {
            // Transparent displays have no opaque mode.
            session.blend_mode_preference = vec![
                EnvironmentBlendMode::OPAQUE,
                EnvironmentBlendMode::ADDITIVE,
                EnvironmentBlendMode::ALPHA_BLEND,
            ];
        }
        app.init_resource::<Passthrough>()
            .add_systems(Startup, actions::create.run_if(openxr_session_available))
            .add_systems(XrSessionCreated, (actions::locate_hands, actions::attach).chain())
            .add_systems(OxrSendActionBindings, actions::suggest_bindings)
            .add_systems(XrPreDestroySession, actions::destroy_spaces)
            .add_systems(
                PreUpdate,
                (
                    actions::sync.before(OxrActionSetSyncSet),
                    (actions::read, fingers::read).chain().after(OxrActionSetSyncSet).after(XrSpaceSyncSet),
                )
                    .run_if(openxr_session_running),
            )
            .add_systems(Update, passthrough::blend.run_if(openxr_session_running));
    }
}
