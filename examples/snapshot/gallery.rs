//! One scene by every method, side by side.

use bevy::prelude::*;
use bevy_contextual_ao::prelude::*;
use plotters::prelude::{BitMapBackend, DrawingBackend, IntoFont, IntoTextStyle, RGBColor};

use crate::{
    Options,
    common::{font, headless::Headless, scene::SceneOptions, stability::methods},
};

/// Pictures in a row.
const COLUMNS: u32 = 4;
/// Height of the letters, and of the strip that they stand in, pixels.
const LETTERS: u32 = 20;
const STRIP: u32 = 30;

/// Renders the scene by every method, and unshaded and lit without occlusion, into one image.
pub fn render(options: &Options) -> Result<image::RgbImage, String> {
    let mut pictures = vec![
        ("no occlusion".to_owned(), picture(&options.scene, ShadingMode::Solid, None)?),
        ("Blinn-Phong".to_owned(), picture(&options.scene, ShadingMode::Phong, None)?),
    ];
    for column in methods::columns() {
        let shown = picture(&options.scene, ShadingMode::Cao, Some(&column.occlusion))?;
        pictures.push((column.name.to_owned(), shown));
    }
    compose(&pictures, options.scene.size)
}

/// The scene, by the method and at the resolution of some settings.
fn picture(
    options: &SceneOptions,
    mode: ShadingMode,
    settings: Option<&AmbientOcclusion>,
) -> Result<Vec<u8>, String> {
    let mut headless = Headless::new(options.size, |app| {
        app.insert_resource(ClearColor(Color::srgb(0.06, 0.07, 0.08)));
    });
    let scene = options.spawn(&mut headless)?;
    let world = headless.app.world_mut();
    if let Some(mut shading) = world.get_mut::<VolumeShading>(scene.volume) {
        shading.mode = mode;
    }
    let mut frames = 2;
    if let (Some(mut occlusion), Some(settings)) = (world.get_mut::<AmbientOcclusion>(scene.volume), settings)
    {
        occlusion.method = settings.method;
        occlusion.resolution = settings.resolution;
        if let OcclusionMethod::Progressive(_) = settings.method {
            // Some of its rays: how it looks on the way.
            frames = occlusion.pattern.rays() / 4;
        }
    }
    headless.until_ready(scene.volume)?;
    headless.frames(frames);
    Ok(headless.image())
}

fn compose(pictures: &[(String, Vec<u8>)], size: UVec2) -> Result<image::RgbImage, String> {
    let rows = (pictures.len() as u32).div_ceil(COLUMNS);
    let (width, height) = (COLUMNS * size.x, rows * (size.y + STRIP));
    let mut sheet = image::RgbImage::from_pixel(width, height, image::Rgb([255; 3]));
    let corner = |k: usize| UVec2::new(k as u32 % COLUMNS * size.x, k as u32 / COLUMNS * (size.y + STRIP));
    for (k, (_, pixels)) in pictures.iter().enumerate() {
        let corner = corner(k);
        for (place, pixel) in (0..).zip(pixels.chunks(4)) {
            let (x, y) = (corner.x + place % size.x, corner.y + STRIP + place / size.x);
            sheet.put_pixel(x, y, image::Rgb([pixel[0], pixel[1], pixel[2]]));
        }
    }
    font::register()?;
    let mut backend = BitMapBackend::with_buffer(&mut sheet, (width, height));
    let style = (font::NAME, f64::from(LETTERS))
        .into_font()
        .color(&RGBColor(20, 20, 20))
        .into_text_style(&(width, height));
    for (k, (name, _)) in pictures.iter().enumerate() {
        let corner = corner(k);
        let place = (corner.x as i32 + 8, corner.y as i32 + 5);
        backend.draw_text(name, &style, place).map_err(|error| error.to_string())?;
    }
    drop(backend);
    Ok(sheet)
}
