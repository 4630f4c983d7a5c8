//! Part of the panel about files.

use bevy::{asset::LoadState, ecs::system::SystemParam, prelude::*};
use bevy_contextual_ao::prelude::*;
use bevy_egui::egui::{ComboBox, ProgressBar, Ui};

use super::{
    dicom::{
        Reading, SeriesList,
        panel::{ERROR, show_progress},
    },
    dropping::Hovering,
    loading::Opening,
    picture::SavedPicture,
    shown::{FunctionSource, Shown},
};

/// State of the files.
#[derive(SystemParam)]
pub struct Files<'w> {
    assets: Res<'w, AssetServer>,
    opening: Res<'w, Opening>,
    pub list: Res<'w, SeriesList>,
    pub reading: Res<'w, Reading>,
    hovering: Res<'w, Hovering>,
    picture: Res<'w, SavedPicture>,
}

/// Shows the current file, files that are being read, and errors.
pub fn show(ui: &mut Ui, files: &Files, shown: &Shown, volume: &Volume3d, ready: OcclusionReady) {
    if !shown.name.is_empty() {
        ui.strong(&shown.name);
    }
    if files.hovering.0 {
        ui.label("drop it to open it");
    }
    if files.opening.is_busy() {
        ui.label("another file is being read");
    }
    if let Some(progress) = files.list.progress() {
        show_progress(ui, "files", progress);
    }
    if let Some((title, progress)) = files.reading.progress() {
        show_progress(ui, &format!("{title}, slices"), progress);
    }
    for error in &shown.errors {
        ui.colored_label(ERROR, error);
    }
    match &files.picture.0 {
        Some(Ok(name)) => drop(ui.label(format!("saved {name}"))),
        Some(Err(reason)) => drop(ui.colored_label(ERROR, reason)),
        None => (),
    }
    match (&shown.content, files.assets.get_load_state(&volume.0)) {
        (Some(content), _) => {
            ui.weak(&content.summary);
            for warning in &shown.opened.warnings {
                ui.weak(warning);
            }
            ui.weak(if ready.0 { "ambient occlusion complete" } else { "ambient occlusion on its way" });
        }
        // Without a state nothing has been opened yet.
        (None, Some(LoadState::Failed(_)) | None) => {
            let has_series = files.list.found.as_ref().is_some_and(|found| !found.entries.is_empty());
            ui.weak(if has_series { "click a series to show it" } else { "nothing to show" });
        }
        // The share of the file that has been read is not known.
        (None, _) => {
            let sweep = (ui.input(|input| input.time) % 1.0) as f32;
            ui.add(ProgressBar::new(sweep).text("reading the file"));
        }
    }
}

/// Shows a menu of presets, and returns the preset that was chosen now.
pub fn choose_preset(ui: &mut Ui, source: FunctionSource) -> Option<Preset> {
    let current = match source {
        FunctionSource::Volume => "from the volume",
        FunctionSource::Preset(preset) => preset.name(),
        FunctionSource::File => "from a file",
    };
    let mut chosen = None;
    ComboBox::from_label("transfer function").selected_text(current).show_ui(ui, |ui| {
        for preset in Preset::ALL {
            if ui.selectable_label(source == FunctionSource::Preset(preset), preset.name()).clicked() {
                chosen = Some(preset);
            }
        }
    });
    chosen
}
