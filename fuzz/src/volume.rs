//! The readers' sources, with the same modules as the plugin's own `volume` module.

#[path = "../../src/volume/asset.rs"]
pub(crate) mod asset;
#[path = "budget.rs"]
pub(crate) mod budget;
#[cfg(feature = "dicom")]
#[path = "dicom.rs"]
pub mod dicom;
#[path = "../../src/volume/error.rs"]
pub(crate) mod error;
#[path = "../../src/volume/halve.rs"]
mod halve;
#[path = "../../src/volume/otsu.rs"]
mod otsu;
#[path = "../../src/volume/readers/mod.rs"]
pub(crate) mod readers;
#[path = "../../src/volume/slicer/mod.rs"]
mod slicer;
#[path = "../../src/volume/transfer_function.rs"]
pub(crate) mod transfer_function;
#[path = "../../src/volume/transfer_function_error.rs"]
pub(crate) mod transfer_function_error;
#[path = "../../src/volume/transfer_function_files.rs"]
mod transfer_function_files;
#[path = "../../src/volume/transfer_function_samples.rs"]
mod transfer_function_samples;

pub use asset::{Intensities, Volume};
pub use error::{VolumeError, VolumeFileError};
pub use readers::{VolumeReadSettings, read_volume_file, read_volume_file_with};
pub use transfer_function::{ControlPoint, GradientPoint, TransferFunction};
pub use transfer_function_error::TransferFunctionError;
