//! What Bevy does not forget by itself when the device is lost.

use bevy::{pbr::BuildIndirectParametersBindGroups, prelude::*};

/// Bevy 0.19.1 keeps these bind groups of a lost device until new ones are made, and panics when it
/// uses them before that.
pub(crate) fn forget_lost_bind_groups(mut commands: Commands) {
    commands.remove_resource::<BuildIndirectParametersBindGroups>();
}
