//! Lists the series of folders, DICOMDIRs and archives.

use std::path::{Path, PathBuf};

use super::{
    find::{Found, find, reason},
    image::Image,
    left_out::{LeftOut, Reason, count},
    parallel::{DicomProgress, each},
    parse::{Unparsed, parse},
    series::sort,
    slice::{Slice, slices},
    source::Source,
    volume::DicomSeries,
};
use crate::volume::error::{VolumeError, VolumeFileError};

/// Series that were found, and the files that belong to none.
#[derive(Debug)]
pub struct Dicom {
    /// The series, that with the most slices first.
    pub series: Vec<DicomSeries>,
    /// Files that are no slice of a volume, with the reason of each.
    pub left_out: Vec<LeftOut>,
}

impl Dicom {
    /// Reasons of the [files that belong to none](Self::left_out), with the number of files of each, the most frequent
    /// first. No file is named: names of files often hold the patient's.
    pub fn reasons(&self) -> Vec<(usize, String)> {
        count(&self.left_out)
    }
}

/// Lists the series in files, folders (with the folders in them), DICOMDIRs and zip archives.
///
/// Only the beginnings of files are read. [`DicomVolume::read`](super::DicomVolume::read) reads the pixels. Names and
/// birthdays are neither kept nor printed; errors name files.
///
/// This function blocks while Bevy's `AsyncComputeTaskPool` reads.
///
/// # Errors
///
/// [`VolumeFileError`] if a path is not there or an archive is damaged. A file that cannot be used is
/// [left out](Dicom::left_out).
pub fn read_dicom(paths: &[impl AsRef<Path>]) -> Result<Dicom, VolumeFileError> {
    read_dicom_with(paths, &DicomProgress::default())
}

/// Lists series as [`read_dicom`] does, with progress file by file.
///
/// # Errors
///
/// As [`read_dicom`].
pub fn read_dicom_with(
    paths: &[impl AsRef<Path>],
    progress: &DicomProgress,
) -> Result<Dicom, VolumeFileError> {
    let paths: Vec<PathBuf> = paths.iter().map(|path| path.as_ref().to_owned()).collect();
    Ok(list(find(&paths)?, progress))
}

/// Lists the series of files that were found.
pub(super) fn list(found: Found, progress: &DicomProgress) -> Dicom {
    let Found { sources, mut left_out } = found;
    progress.begin(sources.len());
    let headers = each(sources, progress, |source| Ok::<_, std::convert::Infallible>(header(source)));
    let Ok(headers) = headers;
    let mut slices = Vec::new();
    for header in headers.into_iter().flatten() {
        match header {
            Ok(of_file) => slices.extend(of_file),
            Err(one) => left_out.push(one),
        }
    }
    let series = sort(slices, &mut left_out);
    left_out.sort_by(|a, b| a.path.cmp(&b.path));
    Dicom { series, left_out }
}

/// Bytes of a file that are read at first; most files' fields are in them.
const FIRST_BYTES: u64 = 1 << 16;

/// The slices of a file, or why it has none.
fn header(source: Source) -> Result<Vec<Slice>, LeftOut> {
    let mut length = FIRST_BYTES;
    loop {
        let bytes = match source.range(0, length) {
            Ok(bytes) => bytes,
            Err(cause) => return Err(unreadable(source, cause)),
        };
        let whole = (bytes.len() as u64) < length || bytes.len() as u64 == source.length();
        match parse(&bytes, whole) {
            Err(Unparsed::Short) if !whole => length = length.saturating_mul(4),
            Err(unparsed) => return Err(LeftOut { path: source.path, reason: reason(unparsed) }),
            Ok(parsed) => {
                let image = match Image::of(&source, &parsed) {
                    Ok(image) => image,
                    Err(reason) => return Err(LeftOut { path: source.path, reason }),
                };
                return slices(image, &parsed)
                    .map_err(|(image, reason)| LeftOut { path: image.source.path.clone(), reason });
            }
        }
    }
}

fn unreadable(source: Source, cause: VolumeError) -> LeftOut {
    LeftOut { path: source.path, reason: Reason::Unreadable(cause) }
}
