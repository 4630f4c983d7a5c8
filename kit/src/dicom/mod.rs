//! DICOM for programs with a command line or a window: paths that are read as DICOM, the choice of a volume, and series as
//! text and as pictures. No text names a patient, a file or a folder.

mod choice;
mod picture;
mod text;

pub use choice::{Choice, choose, settings};
pub use picture::picture;
pub use text::{facts, list, reasons, series_title, title};

use std::{fs::File, io::Read, path::Path};

/// Whether a path is read as DICOM: a folder, an archive, a file with an ending of DICOM or without any, or a file whose
/// beginning says so.
pub fn is_dicom(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    match ending.as_deref() {
        Some("dcm" | "dicom" | "ima" | "zip") => true,
        None => path.exists(),
        // The last part of an identifier may look like an ending.
        Some(_) => path.is_dir() || has_mark(path),
    }
}

/// Whether a file begins as DICOM files do.
fn has_mark(path: &Path) -> bool {
    let mut beginning = [0; 132];
    let read = File::open(path).and_then(|mut file| file.read_exact(&mut beginning));
    read.is_ok() && beginning.ends_with(b"DICM")
}
