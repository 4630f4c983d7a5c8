//! The room around the user, behind everything that is drawn.

use bevy::prelude::*;
use bevy_mod_openxr::environment_blend_mode::OxrEnvironmentBlendModes;
use openxr::EnvironmentBlendMode;

/// Whether the room shows, where the headset can show it.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Passthrough {
    /// Whether the runtime can. The example writes it.
    pub is_available: bool,
    /// Whether the user wants it.
    pub is_on: bool,
}

/// Blends as the user wants: the room shows where nothing is drawn.
pub(super) fn blend(
    modes: Option<ResMut<OxrEnvironmentBlendModes>>,
    mut passthrough: ResMut<Passthrough>,
    mut background: ResMut<ClearColor>,
    mut opaque_background: Local<Option<Color>>,
) {
    let Some(mut modes) = modes else {
        return;
    };
    // Transparent displays add light to the room, and have no other mode.
    let shows = [EnvironmentBlendMode::ALPHA_BLEND, EnvironmentBlendMode::ADDITIVE];
    let mode = shows.into_iter().find(|mode| modes.available_blend_modes().contains(mode));
    if passthrough.is_available != mode.is_some() {
        passthrough.is_available = mode.is_some();
    }
    let wanted = mode.filter(|_| passthrough.is_on).unwrap_or(EnvironmentBlendMode::OPAQUE);
    if modes.blend_mode() == wanted || !modes.set_blend_mode(wanted) {
        return;
    }
    if wanted == EnvironmentBlendMode::OPAQUE {
        background.0 = opaque_background.take().unwrap_or(background.0);
    } else {
        opaque_background.get_or_insert(background.0);
        background.0 = Color::NONE;
    }
}
