//! The headset: poses and inputs of its hands, through OpenXR.

use bevy::prelude::*;

pub struct HeadsetPlugin;

impl Plugin for HeadsetPlugin {
    fn build(&self, _: &mut App) {}
}
