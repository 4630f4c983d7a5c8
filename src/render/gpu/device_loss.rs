//! Removal of resources that Bevy keeps when the device is lost.

use bevy::{pbr::BuildIndirectParametersBindGroups, prelude::*};

/// Removes bind groups of a lost device. Bevy 0.19.1 keeps them until new ones are made, and panics when it uses them
/// before that.
pub(crate) fn forget_lost_bind_groups(mut commands: Commands) {
    commands.remove_resource::<BuildIndirectParametersBindGroups>();
}
