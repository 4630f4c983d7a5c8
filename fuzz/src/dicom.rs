//! The sources of the DICOM reader, without its asset loader and its transfer functions, which need all of Bevy.

#[path = "../../src/volume/dicom/assemble.rs"]
mod assemble;
#[path = "../../src/volume/dicom/codecs.rs"]
mod codecs;
#[path = "../../src/volume/dicom/data_set.rs"]
mod data_set;
#[path = "../../src/volume/dicom/find.rs"]
mod find;
#[path = "../../src/volume/dicom/fragments.rs"]
mod fragments;
#[path = "../../src/volume/dicom/image.rs"]
mod image;
#[path = "../../src/volume/dicom/left_out.rs"]
mod left_out;
#[path = "../../src/volume/dicom/parallel.rs"]
mod parallel;
#[path = "../../src/volume/dicom/parse.rs"]
mod parse;
#[path = "../../src/volume/dicom/phases.rs"]
mod phases;
#[path = "../../src/volume/dicom/pixels.rs"]
mod pixels;
#[path = "../../src/volume/dicom/read.rs"]
mod read;
#[path = "../../src/volume/dicom/rle.rs"]
mod rle;
#[path = "../../src/volume/dicom/series.rs"]
mod series;
#[path = "../../src/volume/dicom/settings.rs"]
mod settings;
#[path = "../../src/volume/dicom/slice.rs"]
mod slice;
#[path = "../../src/volume/dicom/source.rs"]
mod source;
#[path = "../../src/volume/dicom/stack.rs"]
mod stack;
#[path = "../../src/volume/dicom/suv.rs"]
mod suv;
#[path = "../../src/volume/dicom/syntax.rs"]
mod syntax;
#[path = "../../src/volume/dicom/tags.rs"]
mod tags;
#[path = "../../src/volume/dicom/values.rs"]
mod values;
#[path = "../../src/volume/dicom/volume.rs"]
mod volume;

use std::path::Path;

use find::{Found, Kind};
use source::Source;

pub use parallel::DicomProgress;
pub use read::{Dicom, read_dicom};
pub use settings::DicomReadSettings;
pub use volume::{DicomUnit, DicomVolume};

/// Lists the series of files in memory, or of an archive if there is one file.
pub fn list(files: &[&[u8]]) -> Dicom {
    let mut found = Found::default();
    for (index, file) in files.iter().enumerate() {
        let source = Source::memory(Path::new(&format!("{index}.dcm")), file.to_vec());
        match Kind::of(&source) {
            Ok(Kind::Archive) => {
                let _ = found.archive(source);
            }
            _ => found.sources.push(source),
        }
    }
    read::list(found, &DicomProgress::default())
}
