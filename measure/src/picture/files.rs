//! Pictures, truths and their differences as files.

use bevy::math::UVec2;
use image::RgbImage;
use std::path::Path;

/// Factor on differences in pictures of them. No difference is middle grey.
const AMPLIFIED: f64 = 8.0;

/// Writes `PATH_picture.png`, `PATH_truth.png` and `PATH_difference.png`, which is the first minus the second, times 8.
pub fn write(path: &Path, picture: &[[f64; 3]], levels: &[[f64; 3]], size: UVec2) -> Result<(), String> {
    let bytes = |levels: &[f64; 3]| levels.map(|level| level.round() as u8);
    let difference = picture.iter().zip(levels).map(|(shown, level)| {
        [0, 1, 2].map(|channel| {
            let apart = shown[channel] - level[channel];
            (128.0 + AMPLIFIED * apart).round().clamp(0.0, 255.0) as u8
        })
    });
    save(path, "picture", picture.iter().map(bytes), size)?;
    save(path, "truth", levels.iter().map(bytes), size)?;
    save(path, "difference", difference, size)
}

fn save(path: &Path, of: &str, pixels: impl Iterator<Item = [u8; 3]>, size: UVec2) -> Result<(), String> {
    let name = format!("{}_{of}.png", path.file_name().unwrap_or_default().to_string_lossy());
    let path = path.with_file_name(name);
    let image = RgbImage::from_raw(size.x, size.y, pixels.flatten().collect());
    let image = image.ok_or("a picture of another size")?;
    image.save(&path).map_err(|error| format!("{}: {error}", path.display()))
}
