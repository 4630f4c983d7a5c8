//! Saves a picture of the scene, without the panel, when its key is pressed.

use bevy::{
    camera::Viewport,
    image::Image,
    prelude::*,
    render::view::window::screenshot::{Screenshot, ScreenshotCaptured},
};
use bevy_egui::input::egui_wants_any_keyboard_input;
use bevy_panorbit_camera::PanOrbitCamera;
use std::{
    fs::File,
    io::{self, ErrorKind, Write},
    path::{Path, PathBuf},
};

pub struct PicturePlugin;

impl Plugin for PicturePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<SavedPicture>()
            .add_systems(Update, take.run_if(not(egui_wants_any_keyboard_input)));
    }
}

/// Result of the last picture, for the panel: the name of its file, or the reason why it was not saved.
#[derive(Resource, Default)]
pub struct SavedPicture(pub Option<Result<String, String>>);

fn take(keys: Res<ButtonInput<KeyCode>>, mut commands: Commands) {
    if keys.just_pressed(KeyCode::KeyP) {
        commands.spawn(Screenshot::primary_window()).observe(save);
    }
}

fn save(
    captured: On<ScreenshotCaptured>,
    cameras: Query<&Camera, With<PanOrbitCamera>>,
    mut saved: ResMut<SavedPicture>,
) {
    let viewport = cameras.iter().find_map(|camera| camera.viewport.as_ref());
    let result = save_numbered(&captured.image, viewport, Path::new("."));
    match &result {
        Ok(name) => info!("saved {name}"),
        Err(reason) => error!("{reason}"),
    }
    saved.0 = Some(result);
}

/// Crops an image of the window to a viewport, and writes it to a new file in a folder. Returns the file's name.
pub fn save_numbered(image: &Image, viewport: Option<&Viewport>, folder: &Path) -> Result<String, String> {
    let picture = image.clone().try_into_dynamic().map_err(|error| format!("no picture: {error}"))?;
    let picture = match viewport {
        Some(Viewport { physical_position: from, physical_size: size, .. }) => {
            picture.crop_imm(from.x, from.y, size.x, size.y)
        }
        None => picture,
    };
    // Opacity says nothing in a picture of a window.
    let picture = image::DynamicImage::from(picture.to_rgb8());
    let mut png = io::Cursor::new(Vec::new());
    picture.write_to(&mut png, image::ImageFormat::Png).map_err(|error| format!("no picture: {error}"))?;
    let (path, mut file) = create_numbered(folder, "carved").map_err(|(path, error)| of(&path, error))?;
    file.write_all(png.get_ref()).map_err(|error| of(&path, error))?;
    Ok(path.file_name().unwrap_or_default().to_string_lossy().into_owned())
}

fn of(path: &Path, error: io::Error) -> String {
    format!("{}: {error}", path.display())
}

/// Creates a file that was not there before: `STEM-001.png`, or the first number that is free.
pub fn create_numbered(folder: &Path, stem: &str) -> Result<(PathBuf, File), (PathBuf, io::Error)> {
    let mut number = 1;
    loop {
        let path = folder.join(format!("{stem}-{number:03}.png"));
        match File::create_new(&path) {
            Ok(file) => return Ok((path, file)),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => number += 1,
            Err(error) => return Err((path, error)),
        }
    }
}
