//! Part of the panel about series.

use bevy_contextual_ao::volume::dicom::DicomProgress;
use bevy_egui::egui::{
    Button, CollapsingHeader, Color32, ColorImage, Image, ProgressBar, Rect, Sense, TextureHandle,
    TextureOptions, Ui, vec2,
};
use contextual_ao_kit::dicom::Choice;

use super::list::{Entry, Picture, SeriesList};

/// Colour of reasons why something is not shown.
pub const ERROR: Color32 = Color32::from_rgb(255, 120, 100);
/// Width and height of a picture, points of the screen.
const PICTURE: f32 = 64.0;

/// Pictures of the list on the graphics device.
#[derive(Default)]
pub struct Textures {
    /// Number of the list.
    of: u64,
    by_series: Vec<Option<TextureHandle>>,
}

impl Textures {
    /// The texture of a series, once it has a picture.
    fn get(&mut self, ui: &Ui, index: usize, picture: &Picture) -> Option<&TextureHandle> {
        if self.by_series.len() <= index {
            self.by_series.resize(index + 1, None);
        }
        let texture = &mut self.by_series[index];
        if let (None, Picture::Made(picture)) = (&texture, picture) {
            let size = [picture.width(), picture.height()].map(|side| side as usize);
            let image = ColorImage::from_gray(size, picture.as_raw());
            *texture = Some(ui.ctx().load_texture("series", image, TextureOptions::LINEAR));
        }
        texture.as_ref()
    }
}

/// Shows the list, and returns the volume that was clicked now. `chosen` is the volume that is seen.
pub fn show(
    ui: &mut Ui,
    list: &SeriesList,
    chosen: Option<Choice>,
    textures: &mut Textures,
) -> Option<Choice> {
    let found = list.found.as_ref()?;
    if textures.of != list.number {
        *textures = Textures { of: list.number, ..Textures::default() };
    }
    let mut clicked = None;
    for (series, entry) in found.entries.iter().enumerate() {
        let chosen = chosen.filter(|choice| choice.series == series).map(|choice| choice.volume);
        ui.push_id(series, |ui| {
            ui.horizontal_top(|ui| {
                let has_picture_clicked = show_picture(ui, textures.get(ui, series, &entry.picture), entry);
                ui.vertical(|ui| {
                    let volume = show_volumes(ui, entry, chosen);
                    let volume = volume.or(has_picture_clicked.then_some(0));
                    clicked = clicked.or(volume.map(|volume| Choice { series, volume }));
                });
            });
        });
    }
    if !found.left_out.is_empty() {
        CollapsingHeader::new("left out").default_open(true).show(ui, |ui| {
            for reason in &found.left_out {
                ui.weak(reason);
            }
        });
    }
    clicked
}

/// Shows a series' picture on black, and returns whether it was clicked. One click opens the first volume.
fn show_picture(ui: &mut Ui, texture: Option<&TextureHandle>, entry: &Entry) -> bool {
    let (place, response) = ui.allocate_exact_size(vec2(PICTURE, PICTURE), Sense::click());
    ui.painter().rect_filled(place, 0.0, Color32::BLACK);
    if let Some(texture) = texture {
        let longest = texture.size_vec2().max_elem().max(1.0);
        let part = Rect::from_center_size(place.center(), texture.size_vec2() * PICTURE / longest);
        Image::new(texture).paint_at(ui, part);
    }
    response.clicked() && entry.volumes.first().is_some_and(|volume| volume.refused.is_none())
}

/// Shows a series' name and its volumes, and returns the index of the volume that was clicked now.
fn show_volumes(ui: &mut Ui, entry: &Entry, chosen: Option<usize>) -> Option<usize> {
    let mut clicked = None;
    ui.strong(&entry.title);
    for (index, volume) in entry.volumes.iter().enumerate() {
        let button = Button::selectable(chosen == Some(index), &volume.text).wrap();
        if ui.add_enabled(volume.refused.is_none(), button).clicked() {
            clicked = Some(index);
        }
        if let Some(reason) = &volume.refused {
            ui.colored_label(ERROR, reason);
        }
    }
    if let Picture::Failed(reason) = &entry.picture {
        ui.colored_label(ERROR, format!("no picture: {reason}"));
    }
    clicked
}

/// Shows how many files or slices have been read.
pub fn show_progress(ui: &mut Ui, what: &str, progress: &DicomProgress) {
    let [done, total] = [progress.done(), progress.total()];
    let share = done as f32 / total.max(1) as f32;
    // Values are brought to one scale, and slices are interpolated, after the last one was read.
    let text = match (done, total) {
        (_, 0) => what.to_owned(),
        _ if done < total => format!("{what}: {done} of {total}"),
        _ => format!("{what}: nearly done"),
    };
    ui.add(ProgressBar::new(share).text(text));
}
