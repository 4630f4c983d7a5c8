//! The cameras that the user sees through: two in a headset, one on the desktop.

use bevy::{
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    prelude::*,
};
use bevy_mod_xr::camera::{XrCamera, XrProjection};

use super::rig::Eye;

/// Nearest that eyes see, metres. At the 0.1 of XR crates a head held near the eyes is cut open.
pub const NEAR: f32 = 0.01;

pub struct EyesPlugin;

impl Plugin for EyesPlugin {
    fn build(&self, app: &mut App) {
        app.add_observer(see_near).add_observer(see_colors);
    }
}

/// Makes an eye of a camera that the headset spawns.
fn see_near(camera: On<Add, XrCamera>, mut commands: Commands) {
    let near = Projection::custom(XrProjection { near: NEAR, ..default() });
    commands.entity(camera.entity).insert((Eye, near));
}

/// Colours of transfer functions are shown unchanged, and no noise differs between the eyes.
fn see_colors(eye: On<Add, Eye>, mut commands: Commands) {
    commands.entity(eye.entity).insert((Tonemapping::None, DebandDither::Disabled));
}
