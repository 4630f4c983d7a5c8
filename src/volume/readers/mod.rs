//! Reads volumes from NIfTI, NRRD and MetaImage files.
//!
//! Each format's module turns a header into the common [`GridHeader`]. [`decode`](decode::decode)
//! turns this header and the data into a [`Volume`]. The two steps are apart so that an asynchronous
//! loader can fetch a separate data file in between.

mod ascii;
pub(crate) mod decode;
pub(crate) mod header;
mod length_unit;
#[cfg(feature = "meta_image")]
mod meta_image;
#[cfg(feature = "nifti")]
mod nifti;
#[cfg(feature = "nifti")]
mod nifti2;
#[cfg(feature = "nifti")]
mod nifti_fields;
#[cfg(feature = "nifti")]
mod nifti_geometry;
#[cfg(feature = "nrrd")]
mod nrrd;
#[cfg(feature = "nrrd")]
mod nrrd_axes;
#[cfg(feature = "nrrd")]
mod nrrd_fields;
#[cfg(feature = "nrrd")]
mod nrrd_kinds;
#[cfg(feature = "nrrd")]
mod nrrd_space;
mod settings;
mod store;

use std::path::{Path, PathBuf};

use bevy::log::warn;

pub use self::settings::VolumeReadSettings;

use self::header::{DataLocation, GridHeader};
use super::asset::Volume;
use super::error::{VolumeError, VolumeFileError};

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// NIfTI-1 and NIfTI-2: `.nii`, `.nii.gz`, or `.hdr` and `.img`, each optionally with `.gz`.
    Nifti,
    /// NRRD 1 to 5: `.nrrd`, or `.nhdr` with a data file.
    Nrrd,
    /// MetaImage: `.mha`, or `.mhd` with a data file.
    MetaImage,
}

impl Format {
    /// The format by the ending of a file's name, in upper or lower case.
    pub(crate) fn of(path: &Path) -> Result<Self, VolumeError> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let name = name.to_ascii_lowercase();
        let ends = |endings: &[&str]| endings.iter().any(|ending| name.ends_with(ending));
        if ends(&[".nii", ".nii.gz", ".hdr", ".hdr.gz"]) {
            Ok(Self::Nifti)
        } else if ends(&[".nrrd", ".nhdr"]) {
            Ok(Self::Nrrd)
        } else if ends(&[".mha", ".mhd"]) {
            Ok(Self::MetaImage)
        } else {
            let ending = name.rsplit('.').next().unwrap_or(&name).to_owned();
            Err(VolumeError::UnknownExtension { ending })
        }
    }

    /// The Cargo feature of the format's reader.
    #[cfg(not(all(feature = "nifti", feature = "nrrd", feature = "meta_image")))]
    fn feature(self) -> &'static str {
        match self {
            Self::Nifti => "nifti",
            Self::Nrrd => "nrrd",
            Self::MetaImage => "meta_image",
        }
    }

    /// Reads the header at the beginning of a file of this format.
    pub(crate) fn parse(
        self,
        bytes: &[u8],
        settings: &VolumeReadSettings,
    ) -> Result<GridHeader, VolumeError> {
        let header = match self {
            #[cfg(feature = "nifti")]
            Self::Nifti => nifti::parse(bytes, settings),
            #[cfg(feature = "nrrd")]
            Self::Nrrd => nrrd::parse(bytes, settings),
            #[cfg(feature = "meta_image")]
            Self::MetaImage => meta_image::parse(bytes, settings),
            #[cfg(not(all(feature = "nifti", feature = "nrrd", feature = "meta_image")))]
            _ => Err(VolumeError::LeftOut { feature: self.feature() }),
        };
        settings.scale(header?)
    }
}

/// Possible paths of the data file of the header at `header_path`, likeliest first. There are none if the
/// data are in the header's own file. All are in the header's folder or below it.
pub(crate) fn data_file_candidates(header_path: &Path, header: &GridHeader) -> Vec<PathBuf> {
    match &header.data {
        DataLocation::Attached { .. } => Vec::new(),
        DataLocation::Detached { file } => vec![header_path.with_file_name(file)],
        DataLocation::NiftiPair => {
            let name = header_path.file_name().unwrap_or_default();
            let name = name.to_string_lossy();
            let lower = name.to_ascii_lowercase();
            let gzip = lower.ends_with(".gz");
            let stem = [".hdr.gz", ".nii.gz", ".hdr", ".nii"]
                .into_iter()
                .find(|ending| lower.ends_with(ending))
                .and_then(|ending| name.get(..name.len() - ending.len()))
                .unwrap_or(&name);
            let endings = if gzip { [".img.gz", ".img"] } else { [".img", ".img.gz"] };
            endings.map(|ending| header_path.with_file_name(format!("{stem}{ending}"))).to_vec()
        }
    }
}

/// Reads a volume from a NIfTI, NRRD or MetaImage file.
///
/// The file's name tells the format: `.nii`, `.nii.gz`, `.hdr`, `.hdr.gz`, `.nrrd`, `.nhdr`, `.mha` or `.mhd`.
///
/// The data file of a header that names one is read too; it must be in the header's folder or below it.
/// A warning in the log says how many voxels are no numbers, if any: see [`Volume::background_voxels`].
/// This function blocks: in an app, load the file as an asset instead.
///
/// # Errors
///
/// [`VolumeFileError`] names the file and the cause. No content of a file makes this function panic. Memory
/// grows with the file's decompressed content, whatever its header claims.
pub fn read_volume_file(path: &Path) -> Result<Volume, VolumeFileError> {
    read_volume_file_with(path, &VolumeReadSettings::default())
}

/// Reads a volume as [`read_volume_file`] does, with settings.
///
/// # Errors
///
/// As [`read_volume_file`].
pub fn read_volume_file_with(path: &Path, settings: &VolumeReadSettings) -> Result<Volume, VolumeFileError> {
    let at = |path: &Path, cause: VolumeError| VolumeFileError { path: path.to_owned(), cause };
    let of_header = |cause| at(path, cause);
    let format = Format::of(path).map_err(of_header)?;
    let bytes = std::fs::read(path).map_err(|error| of_header(error.into()))?;
    let header = format.parse(&bytes, settings).map_err(of_header)?;
    let candidates = data_file_candidates(path, &header);
    let volume = if let Some(first) = candidates.first() {
        drop(bytes);
        let data_path = candidates.iter().find(|path| path.is_file()).unwrap_or(first);
        let data = std::fs::read(data_path).map_err(|error| at(data_path, error.into()))?;
        decode::decode(&header, &data).map_err(|cause| at(data_path, cause))?
    } else {
        decode::decode(&header, &bytes).map_err(of_header)?
    };
    warn_of_background(path, &volume);
    Ok(settings.halve(volume))
}

/// Logs a warning with the number of voxels of a file that are no numbers, if any.
pub(crate) fn warn_of_background(path: &Path, volume: &Volume) {
    let count = volume.background_voxels();
    if count > 0 {
        let (path, all) = (path.display(), volume.voxel_count());
        warn!("{path}: {count} of {all} voxels are NaN or infinite: they are shown as background");
    }
}
