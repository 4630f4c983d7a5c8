//! Why a volume could not be made or read.

use std::path::PathBuf;

/// Why bytes, or values given in code, do not make a [`Volume`](super::Volume).
///
/// It names the cause but no file; [`VolumeFileError`] adds the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VolumeError {
    /// The format's reader was left out of the build.
    #[error("files of this format are read with the Cargo feature `{feature}` of bevy_contextual_ao alone")]
    LeftOut {
        /// The feature.
        feature: &'static str,
    },
    /// The file's name does not end like any format that can be read.
    #[error(
        "unknown file name ending {ending:?}; expected .nii, .nii.gz, .hdr, .hdr.gz, .nrrd, .nhdr, .mha or .mhd"
    )]
    UnknownExtension {
        /// What follows the name's last dot, or the whole name where it has none.
        ending: String,
    },
    /// The bytes do not begin as the format does.
    #[error("not {expected}")]
    NotThisFormat {
        /// The format that was expected, with its article.
        expected: &'static str,
    },
    /// There are fewer bytes than the header says.
    #[error("truncated: {expected_bytes} bytes expected, {found_bytes} found")]
    Truncated {
        /// Bytes that the header asks for (of the header itself where that is cut off).
        expected_bytes: u64,
        /// Bytes that are there, after decompression where the data are compressed.
        found_bytes: u64,
    },
    /// The grid's size is zero, too large, not three-dimensional or not the data's size.
    #[error("dimensions {sizes:?}: {reason}")]
    Dimensions {
        /// Voxels along each axis, as stated.
        sizes: Vec<u64>,
        /// What is wrong with them.
        reason: String,
    },
    /// A header field, or a value given in code, is missing or has an impossible value.
    #[error("{field} is {value:?}: {reason}")]
    Field {
        /// The field's name, as the format spells it.
        field: &'static str,
        /// Its value; empty where the field is missing.
        value: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Every voxel, or pixel, has several values that belong together: a colour, a vector, a complex number.
    #[error("{kind}, {values} values per voxel: not a volume of one number per voxel")]
    NotScalar {
        /// What the image is, with its article and the file's word for it.
        kind: String,
        /// Values per voxel.
        values: u64,
    },
    /// The file holds several volumes, of which one must be chosen; or not the one that was chosen.
    #[error(
        "{count} volumes ({along}){}: choose one by its component, 0 to {}",
        chosen.map_or(String::new(), |chosen| format!(", none of them component {chosen}")),
        count.saturating_sub(1)
    )]
    Component {
        /// How many there are.
        count: u64,
        /// What tells them apart.
        along: String,
        /// The one that was chosen in [`VolumeReadSettings`](super::VolumeReadSettings), if one was.
        chosen: Option<u32>,
    },
    /// Voxels are of a number type that is unknown or too wide.
    #[error("voxels of type {0} cannot be read")]
    UnsupportedType(String),
    /// The data are stored in a way that cannot be read.
    #[error("data stored as {0} cannot be read")]
    UnsupportedEncoding(String),
    /// The data are compressed or written as text, and damaged.
    #[error("damaged data: {reason}")]
    Damaged {
        /// What the decoder found.
        reason: String,
    },
    /// All voxels are NaN or infinite.
    #[error("all {count} voxels are NaN or infinite")]
    NotANumber {
        /// How many there are.
        count: u64,
    },
    /// The file could not be read.
    #[error(transparent)]
    Io(#[from] std::io::Error),
}

impl VolumeError {
    /// A [`VolumeError::Field`] from anything that can be shown.
    pub(crate) fn field(field: &'static str, value: impl ToString, reason: impl Into<String>) -> Self {
        Self::Field { field, value: excerpt(&value.to_string()), reason: reason.into() }
    }
}

/// As much of a file's text as an error shows: the rest of it may be the whole file.
pub(crate) fn excerpt(text: &str) -> String {
    text.chars().take(200).collect()
}

/// A file that could not be read as a volume, and why.
#[derive(Debug, thiserror::Error)]
#[error("{}: {cause}", path.display())]
pub struct VolumeFileError {
    /// The file at fault: of a header with a separate data file, the one that could not be read,
    /// or the header where the two do not fit together.
    pub path: PathBuf,
    /// What is wrong with it.
    #[source]
    pub cause: VolumeError,
}
