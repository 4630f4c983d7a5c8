//! DICOM files: real series, files written here, and other readers' results.

mod hostile;
mod loading;
mod oracles;
mod properties;
pub use properties::read;
mod real_series;
pub mod scan;
pub mod study;
pub mod written;
