//! Files that are no slice of a volume, and why.

use std::{collections::BTreeMap, path::PathBuf};

use crate::volume::error::VolumeError;

/// A file, or a frame of one, that belongs to no volume.
#[derive(Debug, thiserror::Error)]
#[error("{}: {reason}", path.display())]
pub struct LeftOut {
    /// The file.
    pub path: PathBuf,
    /// The reason.
    pub reason: Reason,
}

impl Reason {
    /// The reason without the name of a file, so that files have one in common.
    fn nameless(&self) -> String {
        match self {
            Self::Duplicate { .. } => "the same image as another file".into(),
            reason => reason.to_string(),
        }
    }
}

/// Counts the files of each reason, the most frequent first. No file is named.
pub(super) fn count(left_out: &[LeftOut]) -> Vec<(usize, String)> {
    let mut counts = BTreeMap::new();
    for one in left_out {
        *counts.entry(one.reason.nameless()).or_insert(0) += 1;
    }
    let mut counts: Vec<_> = counts.into_iter().map(|(reason, files)| (files, reason)).collect();
    counts.sort_by_key(|(files, _)| std::cmp::Reverse(*files));
    counts
}

/// Reason why a file belongs to no volume.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Reason {
    /// The file is of another format.
    #[error("not a DICOM file")]
    NotDicom,
    /// A DICOMDIR names a file that is missing.
    #[error("named by the DICOMDIR, but not there")]
    NotThere,
    /// The file is a DICOMDIR within a folder, all of whose files are looked at anyway.
    #[error("an index of files (DICOMDIR)")]
    Index,
    /// The file ends before its pixels begin.
    #[error("the file is cut off")]
    CutOff,
    /// A report, a plan, a presentation state.
    #[error("no picture{}", modality.as_ref().map_or(String::new(), |modality| format!(" ({modality})")))]
    NoPixels {
        /// The modality.
        modality: Option<String>,
    },
    /// A picture for planning, across the slices.
    #[error("a localizer")]
    Localizer,
    /// A picture of a screen, a table or a document.
    #[error("a secondary capture")]
    SecondaryCapture,
    /// Pixels of several values, or of indices into a palette.
    #[error("a picture in colour ({0})")]
    Colour(String),
    /// Labels of one bit.
    #[error("a segmentation (SEG)")]
    Segmentation,
    /// Slices side by side in one picture.
    #[error("a mosaic: its slices lie side by side in one picture")]
    Mosaic,
    /// No place in the patient.
    #[error("without {0}: its place in the patient is unknown")]
    NoPlace(&'static str),
    /// Pixels that are not whole numbers of 8, 16 or 32 bits.
    #[error("pixels {0} cannot be read")]
    Pixels(String),
    /// The compression cannot be read.
    #[error("the transfer syntax {0} cannot be read")]
    TransferSyntax(String),
    /// Values that a table converts.
    #[error("values that a table (Modality LUT) converts cannot be read")]
    ModalityLut,
    /// The same image twice.
    #[error("the same image as {}", of.display())]
    Duplicate {
        /// The file that is kept.
        of: PathBuf,
    },
    /// A picture alone.
    #[error("one slice alone, no volume")]
    SingleSlice,
    /// The reason of other slices, which would be one volume with this.
    #[error("{0}")]
    WithOthers(String),
    /// Files beyond the number that one call reads.
    #[error("more than {max} files")]
    TooMany {
        /// The largest number.
        max: usize,
    },
    /// A damaged file, or a field with an impossible value.
    #[error(transparent)]
    Unreadable(#[from] VolumeError),
}
