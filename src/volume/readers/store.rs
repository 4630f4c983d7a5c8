//! Fits numbers wider than sixteen bits into sixteen or eight.

use crate::volume::asset::Intensities;
use crate::volume::error::VolumeError;

/// Values as stored: the file's number is `step * stored + base`.
pub(super) struct Stored {
    pub(super) intensities: Intensities,
    pub(super) step: f64,
    pub(super) base: f64,
}

impl Stored {
    /// Values that are the file's numbers less `base`, exactly.
    pub(super) fn exactly(intensities: Intensities, base: i32) -> Self {
        Self { intensities, step: 1.0, base: base.into() }
    }
}

/// Stores integers exactly where their range allows it, else in 65536 equal steps.
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
    Stored { intensities, step, base: low as f64 }
}

/// Stores whole numbers exactly where their range allows it, else in 65536 equal steps.
///
/// # Errors
///
/// [`VolumeError::NotANumber`] where a value is NaN or infinite.
pub(super) fn store_floats(values: impl Iterator<Item = f64> + Clone) -> Result<Stored, VolumeError> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let (mut whole, mut count) = (true, 0u64);
    for value in values.clone() {
        count += u64::from(!value.is_finite());
        whole &= value.fract() == 0.0;
        low = low.min(value);
        high = high.max(value);
    }
    if count > 0 {
        return Err(VolumeError::NotANumber { count });
    }
    // Beyond 2^53 doubles skip integers, but differences of neighbours stay exact.
    if whole && high - low <= 65_535.0 {
        let intensities = if high - low <= 255.0 {
            Intensities::U8(values.map(|value| (value - low) as u8).collect())
        } else {
            Intensities::U16(values.map(|value| (value - low) as u16).collect())
        };
        return Ok(Stored { intensities, step: 1.0, base: low });
    }
    // Infinite where the values span more than a double can: such a volume is refused when it is made.
    let width = high - low;
    let step = width / 65_535.0;
    if step < f64::MIN_POSITIVE {
        // One value, or values that differ by less than can be told apart.
        return Ok(Stored {
            intensities: Intensities::U8(values.map(|_| 0).collect()),
            step: 1.0,
            base: low,
        });
    }
    let values = values.map(|value| ((value - low) / width * 65_535.0).round() as u16).collect();
    Ok(Stored { intensities: Intensities::U16(values), step, base: low })
}
