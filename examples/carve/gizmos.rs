//! Shows clip cameras, reaches and listed bricks, or hides them, when their key is pressed.

use bevy::prelude::*;
use bevy_contextual_ao::prelude::*;
use bevy_egui::input::egui_wants_any_keyboard_input;

pub struct GizmosPlugin;

impl Plugin for GizmosPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(Update, toggle.run_if(not(egui_wants_any_keyboard_input)));
    }
}

fn toggle(keys: Res<ButtonInput<KeyCode>>, mut store: ResMut<GizmoConfigStore>) {
    if keys.just_pressed(KeyCode::KeyG) {
        let (_, gizmos) = store.config_mut::<VolumeGizmoConfigGroup>();
        gizmos.draw_all = !gizmos.draw_all;
    }
}
