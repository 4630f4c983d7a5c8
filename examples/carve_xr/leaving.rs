//! The way out: a session ends before the app does, and the app ends with its session or its window.

use bevy::{prelude::*, window::exit_on_all_closed};
use bevy_mod_xr::session::{
    XrRequestExitMessage, XrSessionDestroyedMessage, XrState, XrStateChanged, session_created,
};

pub struct LeavingPlugin;

impl Plugin for LeavingPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(
            Update,
            (
                exit_with_session.run_if(resource_exists::<Messages<XrStateChanged>>),
                // The session ends first, and the app with it.
                end_session.run_if(session_created),
                exit_on_all_closed.run_if(not(session_created)),
            )
                .chain(),
        );
    }
}

/// Ends the app where the user left in the headset. A runtime that is about to restart wants another session.
fn exit_with_session(
    mut changes: MessageReader<XrStateChanged>,
    mut destroyed: MessageReader<XrSessionDestroyedMessage>,
    mut exits: MessageWriter<AppExit>,
    mut is_over: Local<bool>,
) {
    for change in changes.read() {
        if let XrState::Exiting { should_restart } = change.0 {
            *is_over = !should_restart;
        }
    }
    if destroyed.read().count() > 0 && *is_over {
        exits.write(AppExit::Success);
    }
}

/// Asks the runtime to end the session once the window is closed.
fn end_session(
    windows: Query<(), With<Window>>,
    mut request: MessageWriter<XrRequestExitMessage>,
    mut is_asked: Local<bool>,
) {
    if windows.is_empty() && !std::mem::replace(&mut *is_asked, true) {
        request.write_default();
    }
}
