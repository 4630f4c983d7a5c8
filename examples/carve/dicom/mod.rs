//! Series of DICOM files: listed in the panel with pictures, and read where they are clicked. Files are read on other
//! threads; the window goes on meanwhile. Names of files may hold the patient's, so none is shown.

mod list;
pub mod panel;
mod reading;
mod work;

use bevy::prelude::*;

pub use list::SeriesList;
pub use reading::{OpenVolume, Reading};

pub struct DicomPlugin;

impl Plugin for DicomPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<SeriesList>()
            .init_resource::<Reading>()
            .add_systems(Update, (list::finish, list::make_pictures, reading::finish).chain())
            .add_observer(list::begin)
            .add_observer(reading::begin)
            .add_observer(reading::give_up);
    }
}
