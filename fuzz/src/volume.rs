//! The readers' sources, as the plugin's own `volume` module has them.

#[path = "../../src/volume/asset.rs"]
pub(crate) mod asset;
#[path = "../../src/volume/error.rs"]
pub(crate) mod error;
#[path = "../../src/volume/otsu.rs"]
mod otsu;
#[path = "../../src/volume/readers/mod.rs"]
pub(crate) mod readers;
#[path = "../../src/volume/slicer.rs"]
mod slicer;
#[path = "../../src/volume/transfer_function.rs"]
pub(crate) mod transfer_function;

pub use asset::{Intensities, Volume};
pub use error::{VolumeError, VolumeFileError};
pub use readers::read_volume_file;
pub use transfer_function::{ControlPoint, TransferFunction, TransferFunctionError};
