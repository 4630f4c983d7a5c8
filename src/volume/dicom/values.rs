//! Brings the slices of a volume to one conversion of numbers to file units, and padding to air.

use super::pixels::Decoded;
use crate::volume::{asset::Rescale, error::VolumeError};

/// Conversion of all slices' numbers.
#[derive(Debug, PartialEq)]
pub(super) struct Unified {
    pub rescale: Rescale,
    /// Number of padding: the lowest value of the volume.
    air: u16,
    /// Whether slices have conversions of their own.
    differ: bool,
}

/// Finds the conversion.
///
/// One that all slices have is kept, and with it every number. Otherwise the range of all values is cut into 65535
/// steps.
pub(super) fn unify(slices: &[Decoded]) -> Result<Unified, VolumeError> {
    let with_values = || slices.iter().filter_map(|slice| Some((slice.range?, slice.rescale)));
    let Some((_, first)) = with_values().next() else {
        let value = slices.len();
        return Err(VolumeError::field("PixelPaddingValue", value, "every pixel of these slices is padding"));
    };
    if with_values().all(|(_, rescale)| rescale == first) {
        let ends = with_values().map(|([low, high], _)| if first.slope < 0.0 { high } else { low });
        let air = if first.slope < 0.0 { ends.max() } else { ends.min() };
        return Ok(Unified { rescale: first, air: air.unwrap_or(0), differ: false });
    }
    let ends = with_values().flat_map(|(range, rescale)| {
        range.map(|number| rescale.slope * f64::from(number) + rescale.intercept)
    });
    let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    let step = (high - low) / 65_535.0;
    let slope = if step >= f64::MIN_POSITIVE { step } else { 1.0 };
    Ok(Unified { rescale: Rescale { slope, intercept: low }, air: 0, differ: true })
}

impl Unified {
    /// Converts the numbers of a slice.
    pub fn convert(&self, slice: &Decoded, numbers: &mut [u16]) {
        let padding = slice.padding.map(|(mark, _)| mark);
        if self.differ {
            let factor = slice.rescale.slope / self.rescale.slope;
            let offset = (slice.rescale.intercept - self.rescale.intercept) / self.rescale.slope;
            for number in numbers {
                let converted = (factor * f64::from(*number) + offset).round() as u16;
                *number = if Some(*number) == padding { self.air } else { converted };
            }
        } else if padding.is_some() {
            numbers
                .iter_mut()
                .filter(|number| Some(**number) == padding)
                .for_each(|number| *number = self.air);
        }
    }
}
