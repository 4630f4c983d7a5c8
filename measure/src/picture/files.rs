//! Pictures, truths and their differences as files.

use bevy::math::UVec2;
use image::RgbImage;
use std::path::Path;

/// Factor on differences in pictures of them. No difference is middle grey.
const AMPLIFIED: f64 = 8.0;

/// Writes `PATH_picture.png`, `PATH_truth.png` and `PATH_difference.png`, which is the first minus the second, times 8.
pub fn write(path: &Path, picture: &[u8], levels: &[[f64; 3]], size: UVec2) -> Result<(), String> {
    let pairs = || picture.chunks_exact(4).zip(levels);
    let shown = pairs().map(|(shown, _)| [shown[0], shown[1], shown[2]]);
    let truth = pairs().map(|(_, level)| level.map(|level| level.round() as u8));
    let difference = pairs().map(|(shown, level)| {
        [0, 1, 2].map(|channel| {
            let apart = f64::from(shown[channel]) - level[channel];
            (128.0 + AMPLIFIED * apart).round().clamp(0.0, 255.0) as u8
        })
    });
    save(path, "picture", shown, size)?;
    save(path, "truth", truth, size)?;
    save(path, "difference", difference, size)
}

fn save(path: &Path, of: &str, pixels: impl Iterator<Item = [u8; 3]>, size: UVec2) -> Result<(), String> {
    let name = format!("{}_{of}.png", path.file_name().unwrap_or_default().to_string_lossy());
    let path = path.with_file_name(name);
    let image = RgbImage::from_raw(size.x, size.y, pixels.flatten().collect());
    let image = image.ok_or("a picture of another size")?;
    image.save(&path).map_err(|error| format!("{}: {error}", path.display()))
}
