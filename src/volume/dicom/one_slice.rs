//! One slice of a volume, for a picture in a list.

use bevy::math::{UVec2, Vec2};

use super::{
    pixels::{Shared, decode},
    volume::DicomVolume,
};
use crate::volume::error::{VolumeError, VolumeFileError};

/// A slice that was decoded alone.
#[derive(Clone, Debug, PartialEq)]
pub struct DicomSlice {
    /// Pixels along a row, and rows.
    pub size: UVec2,
    /// Distances of pixels along a row and down a column, mm.
    pub spacing_mm: Vec2,
    /// Values in [file units](crate::volume::Volume::to_file_units), row by row from the top. Padding is NaN.
    pub values: Vec<f32>,
}

impl DicomVolume {
    /// Decodes one of the [slices](Self::slices) in the files, counted along the normal. No other slice is decoded.
    ///
    /// It blocks, for the time of one file.
    ///
    /// # Errors
    ///
    /// [`VolumeFileError`] names the file and the cause.
    pub fn slice(&self, index: usize) -> Result<DicomSlice, VolumeFileError> {
        let slice = self.stack.slices.get(index).ok_or_else(|| {
            let reason = format!("there are {}, counted from 0", self.slices());
            self.first().image.source.error(VolumeError::field("slice", index, reason))
        })?;
        let image = &slice.image;
        let at = |cause: VolumeError| image.source.error(cause);
        let mut numbers = room::<u16>(image.frame_pixels()).map_err(at)?;
        // Bytes that are swapped in pairs may be another frame's.
        let shared = image.has_swapped_bytes().then(|| Shared::read(image)).transpose().map_err(at)?;
        let decoded = decode(slice, shared.as_ref(), &mut numbers).map_err(at)?;
        let padding = decoded.padding.map(|(mark, _)| mark);
        let mut values = room::<f32>(image.frame_pixels()).map_err(at)?;
        for (value, number) in values.iter_mut().zip(numbers) {
            let rescaled = decoded.rescale.slope * f64::from(number) + decoded.rescale.intercept;
            *value = if Some(number) == padding { f32::NAN } else { rescaled as f32 };
        }
        Ok(DicomSlice {
            size: UVec2::new(image.columns, image.rows),
            spacing_mm: Vec2::from(slice.spacing.map(|mm| mm as f32)),
            values,
        })
    }
}

/// Zeros, if there is room for them.
pub(super) fn room<T: Clone + Default>(count: u64) -> Result<Vec<T>, VolumeError> {
    let out_of_memory = || std::io::Error::from(std::io::ErrorKind::OutOfMemory);
    let count = usize::try_from(count).map_err(|_| out_of_memory())?;
    let mut zeros = Vec::new();
    zeros.try_reserve_exact(count).map_err(|_| out_of_memory())?;
    zeros.resize(count, T::default());
    Ok(zeros)
}
