//! Fits numbers wider than sixteen bits into sixteen or eight.

use crate::volume::{asset::Intensities, error::VolumeError};

/// Values as stored: the file's number is `step * stored + base`.
pub(super) struct Stored {
    pub(super) intensities: Intensities,
    pub(super) step: f64,
    pub(super) base: f64,
    /// Number of voxels that were NaN or infinite, and are background.
    pub(super) background: u64,
}

impl Stored {
    /// Values that are exactly the file's numbers minus `base`.
    pub(super) fn exactly(intensities: Intensities, base: i32) -> Self {
        Self { intensities, step: 1.0, base: base.into(), background: 0 }
    }
}

/// Stores integers exactly if their range allows it, else in 65536 equal steps.
pub(super) fn store_integers(values: impl Iterator<Item = i128> + Clone) -> Stored {
    let (low, high) =
        values.clone().fold((i128::MAX, i128::MIN), |(low, high), value| (low.min(value), high.max(value)));
    // The values come from at most 64 bits, so no difference overflows.
    let width = high.saturating_sub(low);
    let (intensities, step) = if width <= 0xff {
        let values = values.map(|value| (value - low) as u8).collect();
        (Intensities::U8(values), 1.0)
    } else if width <= 0xffff {
        let values = values.map(|value| (value - low) as u16).collect();
        (Intensities::U16(values), 1.0)
    } else {
        let scale = 65_535.0 / width as f64;
        let values = values.map(|value| ((value - low) as f64 * scale).round() as u16).collect();
        (Intensities::U16(values), width as f64 / 65_535.0)
    };
    Stored { intensities, step, base: low as f64, background: 0 }
}

/// Stores whole numbers exactly if their range allows it, else in 65536 equal steps.
///
/// NaN and infinities become background: the lowest of the values in file units. This is the highest number as written
/// if `falling` says that the slope to file units is negative. Otherwise the background is zero if all other numbers
/// are whole numbers from 0 to 65535, as in label maps. So the background is no label, at no cost in accuracy.
///
/// # Errors
///
/// [`VolumeError::NotANumber`] if no value is a finite number.
pub(super) fn store_floats(
    values: impl Iterator<Item = f64> + Clone,
    falling: bool,
) -> Result<Stored, VolumeError> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let (mut whole, mut background) = (true, 0u64);
    for value in values.clone() {
        if value.is_finite() {
            whole &= value.fract() == 0.0;
            low = low.min(value);
            high = high.max(value);
        } else {
            background += 1;
        }
    }
    if low > high {
        return Err(VolumeError::NotANumber { count: background });
    }
    let labels = whole && low >= 0.0 && high <= 65_535.0;
    if background > 0 && labels && !falling {
        low = 0.0;
    }
    let lowest = if falling { high } else { low };
    let values = values.map(move |value| if value.is_finite() { value } else { lowest });
    // Beyond 2^53 doubles skip integers, but differences of neighbours stay exact.
    if whole && high - low <= 65_535.0 {
        let intensities = if high - low <= 255.0 {
            Intensities::U8(values.map(|value| (value - low) as u8).collect())
        } else {
            Intensities::U16(values.map(|value| (value - low) as u16).collect())
        };
        return Ok(Stored { intensities, step: 1.0, base: low, background });
    }
    // The width is infinite if the values span more than a double can hold; making the volume then fails.
    let width = high - low;
    let step = width / 65_535.0;
    if step < f64::MIN_POSITIVE {
        // One value, or values too close to be told apart.
        let intensities = Intensities::U8(values.map(|_| 0).collect());
        return Ok(Stored { intensities, step: 1.0, base: low, background });
    }
    let values = values.map(|value| ((value - low) / width * 65_535.0).round() as u16).collect();
    Ok(Stored { intensities: Intensities::U16(values), step, base: low, background })
}
