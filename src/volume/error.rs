//! Errors of making and reading volumes.

use std::path::PathBuf;

/// Reason why bytes, or values given in code, do not make a [`Volume`](super::Volume).
///
/// The error names the cause but no file; [`VolumeFileError`] adds the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VolumeError {
    /// The format's reader was left out of the build.
    #[error("files of this format are read with the Cargo feature `{feature}` of bevy_contextual_ao alone")]
    LeftOut {
        /// The Cargo feature that adds the reader.
        feature: &'static str,
    },
    /// The file's name has no ending of a readable format.
    #[error(
        "unknown file name ending {ending:?}; expected .nii, .nii.gz, .hdr, .hdr.gz, .nrrd, .nhdr, .mha or .mhd"
    )]
    UnknownExtension {
        /// Text after the name's last dot, or the whole name without a dot.
        ending: String,
    },
    /// The beginning of the bytes does not match the format.
    #[error("not {expected}")]
    NotThisFormat {
        /// The format that was expected, with its article.
        expected: &'static str,
    },
    /// There are fewer bytes than the header says.
    #[error("truncated: {expected_bytes} bytes expected, {found_bytes} found")]
    Truncated {
        /// Bytes that the header asks for, or bytes of the header itself if it is cut off.
        expected_bytes: u64,
        /// Bytes found, after decompression of compressed data.
        found_bytes: u64,
    },
    /// The grid's size is zero, too large, not three-dimensional or not the data's size.
    #[error("dimensions {sizes:?}: {reason}")]
    Dimensions {
        /// Voxels along each axis, as stated.
        sizes: Vec<u64>,
        /// Reason for the refusal.
        reason: String,
    },
    /// A header field, or a value given in code, is missing or has an impossible value.
    #[error("{field} is {value:?}: {reason}")]
    Field {
        /// The field's name, as the format spells it.
        field: &'static str,
        /// The field's value; empty if the field is missing.
        value: String,
        /// Reason for the refusal.
        reason: String,
    },
    /// Every voxel, or pixel, has several values that belong together: a colour, a vector, a complex number.
    #[error("{kind}, {values} values per voxel: not a volume of one number per voxel")]
    NotScalar {
        /// Kind of the image, with its article and the file's word for it.
        kind: String,
        /// Values per voxel.
        values: u64,
    },
    /// The file holds several volumes and none is chosen, or it does not hold the chosen volume.
    #[error(
        "{count} volumes ({along}){}: choose one by its component, 0 to {}",
        chosen.map_or(String::new(), |chosen| format!(", none of them component {chosen}")),
        count.saturating_sub(1)
    )]
    Component {
        /// Number of volumes in the file.
        count: u64,
        /// Name of the difference between the volumes, such as an axis.
        along: String,
        /// The component chosen in [`VolumeReadSettings`](super::VolumeReadSettings), if any.
        chosen: Option<u32>,
    },
    /// The voxels' number type is unknown or too wide.
    #[error("voxels of type {0} cannot be read")]
    UnsupportedType(String),
    /// The data's encoding cannot be read.
    #[error("data stored as {0} cannot be read")]
    UnsupportedEncoding(String),
    /// The data, compressed or written as text, are damaged.
    #[error("damaged data: {reason}")]
    Damaged {
        /// Finding of the decoder.
        reason: String,
    },
    /// All voxels are NaN or infinite.
    #[error("all {count} voxels are NaN or infinite")]
    NotANumber {
        /// Number of voxels.
        count: u64,
    },
    /// The file could not be read.
    #[error(transparent)]
    Io(#[from] std::io::Error),
}

impl VolumeError {
    /// Makes a [`VolumeError::Field`] from a value that can be printed.
    pub(crate) fn field(field: &'static str, value: impl ToString, reason: impl Into<String>) -> Self {
        Self::Field { field, value: excerpt(&value.to_string()), reason: reason.into() }
    }
}

/// The first characters of a file's text, for an error: the text may be the whole file.
pub(crate) fn excerpt(text: &str) -> String {
    text.chars().take(200).collect()
}

/// A file that could not be read as a volume, with the cause.
#[derive(Debug, thiserror::Error)]
#[error("{}: {cause}", path.display())]
pub struct VolumeFileError {
    /// The file at fault. With a separate data file, this is the header if the header cannot be read, else the
    /// data file.
    pub path: PathBuf,
    /// Cause of the failure.
    #[source]
    pub cause: VolumeError,
}
