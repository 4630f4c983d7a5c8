//! DICOM files: real series, files written here, and other readers' results.

mod hostile;
mod loading;
mod oracles;
mod properties;
mod real_series;
mod scan;
mod written;
