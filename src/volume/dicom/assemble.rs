//! Reads the slices of a volume side by side, and makes the volume of them.

use std::{
    collections::HashMap,
    sync::{Arc, OnceLock},
};

use super::{
    image::Image,
    one_slice::room,
    parallel::{DicomProgress, each},
    pixels::{Decoded, Shared, decode},
    settings::DicomReadSettings,
    stack::Grid,
    values::unify,
    volume::DicomVolume,
};
use crate::volume::{
    asset::{Intensities, Volume},
    error::{VolumeError, VolumeFileError},
};

impl DicomVolume {
    /// Reads the volume, with progress slice by slice.
    ///
    /// It blocks while Bevy's `AsyncComputeTaskPool` decodes. At most twice the volume's bytes are taken, beside a
    /// slice and its file for each thread.
    ///
    /// # Errors
    ///
    /// [`VolumeFileError`] names the file and the cause.
    pub fn read(
        &self,
        settings: &DicomReadSettings,
        progress: &DicomProgress,
    ) -> Result<Volume, VolumeFileError> {
        let of_first = |cause| self.first().image.source.error(cause);
        let grid = self.stack.grid(settings).map_err(of_first)?;
        let pixels = self.first().image.frame_pixels().saturating_mul(self.slices() as u64);
        let mut numbers = room::<u16>(pixels).map_err(of_first)?;
        let decoded = self.decode(&mut numbers, progress)?;
        let volume = self.make(&decoded, numbers, &grid).map_err(of_first)?;
        Ok((0..settings.halvings.min(8)).fold(volume, |volume, _| volume.halved()))
    }

    fn decode(&self, numbers: &mut [u16], progress: &DicomProgress) -> Result<Vec<Decoded>, VolumeFileError> {
        let slices = &self.stack.slices;
        progress.begin(slices.len());
        let mut shared: HashMap<*const Image, OnceLock<Result<Shared, Arc<VolumeError>>>> = HashMap::new();
        for slice in slices.iter().filter(|slice| Shared::is_useful(&slice.image)) {
            shared.entry(Arc::as_ptr(&slice.image)).or_default();
        }
        let addresses: Vec<_> = slices.iter().map(|slice| shared.get(&Arc::as_ptr(&slice.image))).collect();
        let pixels = self.first().image.frame_pixels() as usize;
        let work = slices.iter().zip(addresses).zip(numbers.chunks_exact_mut(pixels)).collect();
        let decoded = each(work, progress, |((slice, shared), to)| {
            let source = &slice.image.source;
            let shared = match shared
                .map(|shared| shared.get_or_init(|| Shared::read(&slice.image).map_err(Arc::new)))
            {
                Some(Err(cause)) => {
                    return Err(source.error(VolumeError::Damaged { reason: cause.to_string() }));
                }
                Some(Ok(shared)) => Some(shared),
                None => None,
            };
            decode(slice, shared, to).map_err(|cause| source.error(cause))
        })?;
        let all: Option<Vec<_>> = decoded.into_iter().collect();
        all.ok_or_else(|| {
            self.first().image.source.error(std::io::Error::new(std::io::ErrorKind::Interrupted, "cancelled"))
        })
    }

    fn make(&self, decoded: &[Decoded], mut numbers: Vec<u16>, grid: &Grid) -> Result<Volume, VolumeError> {
        let unified = unify(decoded)?;
        let pixels = self.first().image.frame_pixels() as usize;
        // These steps do not fail, and are over soon: no progress is shown, and none is cancelled.
        let quiet = DicomProgress::default();
        let work = decoded.iter().zip(numbers.chunks_exact_mut(pixels)).collect();
        let convert = |(slice, numbers): (&Decoded, &mut [u16])| {
            unified.convert(slice, numbers);
            Ok::<_, VolumeError>(())
        };
        each(work, &quiet, convert)?;
        if let Some(between) = &grid.between {
            numbers = resample(&numbers, between, pixels, &quiet)?;
        }
        let is_narrow = numbers.iter().all(|&number| number <= 0xff);
        let intensities = if is_narrow && self.first().image.format.bits_stored <= 8 {
            Intensities::U8(numbers.into_iter().map(|number| number as u8).collect())
        } else {
            Intensities::U16(numbers)
        };
        let padding = decoded.iter().filter_map(|slice| slice.padding).map(|(_, count)| count).sum();
        let volume = Volume::new(grid.dimensions, grid.grid_to_patient, intensities, unified.rescale)?;
        Ok(volume.with_background_voxels(padding))
    }
}

/// Slices at even distances, between those of the files.
fn resample(
    numbers: &[u16],
    between: &[(usize, usize, f64)],
    pixels: usize,
    progress: &DicomProgress,
) -> Result<Vec<u16>, VolumeError> {
    let mut resampled = room::<u16>((pixels * between.len()) as u64)?;
    let work = between.iter().zip(resampled.chunks_exact_mut(pixels)).collect();
    each(work, progress, |(&(before, after, share), to): (&(usize, usize, f64), &mut [u16])| {
        let [before, after] = [before, after].map(|slice| &numbers[slice * pixels..][..pixels]);
        for ((to, &before), &after) in to.iter_mut().zip(before).zip(after) {
            let [before, after] = [before, after].map(f64::from);
            *to = (before + share * (after - before)).round() as u16;
        }
        Ok::<_, VolumeError>(())
    })?;
    Ok(resampled)
}
