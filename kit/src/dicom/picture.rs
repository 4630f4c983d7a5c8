//! A volume's picture for a list.

use bevy::math::Vec2;
use bevy_contextual_ao::volume::{
    VolumeFileError,
    dicom::{DicomVolume, Window},
};
use image::{GrayImage, imageops::thumbnail};

/// A picture without a window counts about this many of its pixels.
const SAMPLES: usize = 1 << 12;

/// The slice in the middle of a volume in the file's first window, at most `side` pixels wide and high. No other slice is
/// decoded.
pub fn picture(volume: &DicomVolume, side: u32) -> Result<GrayImage, VolumeFileError> {
    let slice = volume.slice(volume.slices() / 2)?;
    let window = volume.windows().first().copied().unwrap_or_else(|| middle(&slice.values));
    let grey = slice.values.iter().map(|&value| brightness(value, window)).collect();
    let picture = GrayImage::from_raw(slice.size.x, slice.size.y, grey).unwrap_or_default();
    let mm = slice.size.as_vec2() * slice.spacing_mm;
    let [width, height] = (mm * side as f32 / mm.max_element()).max(Vec2::ONE).as_uvec2().to_array();
    Ok(thumbnail(&picture, width, height))
}

/// Brightness of a value; a pixel without one is black.
fn brightness(value: f32, window: Window) -> u8 {
    let share = (f64::from(value) - window.center) / window.width + 0.5;
    // NaN becomes zero.
    (255.0 * share.clamp(0.0, 1.0)) as u8
}

/// The range of values without the lowest and the highest hundredth.
fn middle(values: &[f32]) -> Window {
    let step = values.len() / SAMPLES + 1;
    let mut some: Vec<f32> = values.iter().copied().step_by(step).filter(|value| value.is_finite()).collect();
    some.sort_by(f32::total_cmp);
    let [low, high] = [1, 99].map(|percent| {
        let index = some.len().saturating_sub(1) * percent / 100;
        some.get(index).map_or(0.0, |&value| f64::from(value))
    });
    Window { center: 0.5 * (low + high), width: (high - low).max(f64::MIN_POSITIVE) }
}
