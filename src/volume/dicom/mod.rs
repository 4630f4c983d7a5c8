//! DICOM: the files that hospitals give out.
//!
//! [`read_dicom`] lists the series of a folder, a DICOMDIR or an archive; [`DicomVolume::read`] reads one volume.
//! [`DicomLoader`] does both for assets. `docs/dicom.md` tells what is read and what is refused.
//!
//! The steps, in order: find files, read their fields, make slices of them, sort the slices into series and volumes, put
//! them in order along their normal, decode their pixels, bring their values to one unit.

mod assemble;
mod codecs;
mod data_set;
mod find;
mod first_look;
mod fragments;
mod image;
mod left_out;
mod loader;
mod one_slice;
mod parallel;
mod parse;
mod phases;
mod pixels;
mod read;
mod rle;
mod series;
mod settings;
mod slice;
mod source;
mod stack;
mod suv;
mod syntax;
mod tags;
mod values;
mod volume;

pub use left_out::{LeftOut, Reason};
pub use loader::{DicomLoader, DicomLoads};
pub use one_slice::DicomSlice;
pub use parallel::DicomProgress;
pub use read::{Dicom, read_dicom, read_dicom_with};
pub use settings::{DicomReadSettings, UnevenSlices};
pub use slice::Window;
pub use volume::{DicomGrid, DicomSeries, DicomUnit, DicomVolume};
