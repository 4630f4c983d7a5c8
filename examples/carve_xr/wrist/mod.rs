//! The panel on the left wrist. The other hand points at it, or touches it.

mod panel;
mod pointer;
mod surface;

use bevy::prelude::*;

use super::controls::PanelPointing;

pub struct WristPlugin;

impl Plugin for WristPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<pointer::PanelPointer>()
            .init_resource::<panel::Notice>()
            .add_observer(surface::give_panel)
            .add_systems(
                Update,
                (pointer::point, pointer::tell_egui, pointer::show_dot).chain().in_set(PanelPointing),
            )
            .add_systems(surface::PanelPass, panel::show);
    }
}

pub use panel::Notice;
pub use surface::PLACE;
