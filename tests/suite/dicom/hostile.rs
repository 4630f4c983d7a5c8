//! Files that claim what is not so.

use bevy_contextual_ao::volume::dicom::{Dicom, DicomProgress, DicomReadSettings, read_dicom};
use contextual_ao_kit::random::Random;

use super::{
    scan::Scan,
    written::{Syntax, file, numbers, short, text},
};
use crate::small_files::Scratch;

/// Lists a folder and reads all in it. Errors must name a file of the folder.
fn read_all(scratch: &Scratch) -> (Dicom, usize) {
    let dicom = read_dicom(&[&scratch.0]).unwrap_or_else(|error| panic!("{error}"));
    let mut read = 0;
    for volume in dicom.series.iter().flat_map(|series| &series.volumes) {
        match volume.read(&DicomReadSettings::default(), &DicomProgress::default()) {
            Ok(volume) => {
                assert_eq!(volume.voxel_count(), volume.intensities().len() as u64);
                read += 1;
            }
            Err(error) => {
                let message = error.to_string();
                assert!(message.contains(&*scratch.0.to_string_lossy()), "{message}");
                assert!(message.len() < 4096, "{message}");
            }
        }
    }
    (dicom, read)
}

#[test]
fn broken_bytes_are_refused_without_a_panic() {
    let mut random = Random(21);
    for round in 0..150 {
        let scratch = Scratch::new(&format!("dicom_broken_{round}"));
        let scan = Scan::random(&mut random);
        let order: Vec<u32> = (0..scan.size.z).collect();
        let mut files: Vec<_> = order.iter().map(|&z| scan.slice(z, z)).collect();
        files.push(scan.multi_frame(&order));
        for (index, bytes) in files.iter_mut().enumerate() {
            for _ in 0..random.below(4) {
                let at = random.below(bytes.len());
                bytes[at] = random.below(256) as u8;
            }
            if random.below(4) == 0 {
                bytes.truncate(random.below(bytes.len()));
            }
            scratch.write(&index.to_string(), bytes);
        }
        read_all(&scratch);
    }
}

/// Two slices of some pixels that claim to be of another size.
fn claiming(syntax: Syntax, rows: u16, columns: u16, frames: &str, bytes: usize) -> Scratch {
    let scratch = Scratch::new(&format!("dicom_claim_{syntax:?}_{rows}_{columns}"));
    for z in 0..2 {
        let fields = vec![
            text(0x0020_000e, "UI", "1.2.3"),
            text(0x0028_0008, "IS", frames),
            numbers(0x0020_0032, &[0.0, 0.0, f64::from(z)]),
            numbers(0x0020_0037, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
            numbers(0x0028_0030, &[1.0, 1.0]),
            short(0x0028_0010, rows),
            short(0x0028_0011, columns),
            short(0x0028_0100, 16),
            short(0x0028_0101, 16),
            short(0x0028_0102, 15),
            short(0x0028_0103, 0),
        ];
        scratch.write(&z.to_string(), &file(syntax, fields, &[vec![7; bytes]], 2));
    }
    scratch
}

#[test]
fn claims_beyond_the_file_are_refused_before_room_is_made() {
    for syntax in Syntax::ALL {
        let (dicom, _) = read_all(&claiming(syntax, 65_535, 65_535, "1", 64));
        assert!(dicom.series.is_empty(), "{syntax:?}: {dicom:?}");
        let (dicom, _) = read_all(&claiming(syntax, 8, 4, "60000", 64));
        assert!(dicom.series.is_empty(), "{syntax:?}: {dicom:?}");
        let (dicom, read) = read_all(&claiming(syntax, 8, 4, "1", 64));
        assert_eq!(read, 1, "{syntax:?}: {dicom:?}");
    }
}

#[test]
fn a_codestream_of_another_size_is_refused() {
    let Some(volumes) = crate::needs::shared_volumes() else { return };
    let folder = volumes.join("dicom/hard_cases/compressed_j2k");
    let scratch = Scratch::new("dicom_siz");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let mut bytes = std::fs::read(&path).unwrap();
        let siz = bytes.windows(4).position(|four| four == [0xff, 0x4f, 0xff, 0x51]).expect("a codestream");
        // The width.
        bytes[siz + 8..siz + 12].copy_from_slice(&40_000u32.to_be_bytes());
        scratch.write(path.file_name().unwrap().to_str().unwrap(), &bytes);
    }
    let dicom = read_dicom(&[&scratch.0]).unwrap();
    let volume = &dicom.series[0].volumes[0];
    let refused = volume.read(&DicomReadSettings::default(), &DicomProgress::default());
    let message = refused.expect_err("the widths differ").to_string();
    assert!(message.contains("40000x256 pixels, and 256x256 by the file"), "{message}");
}
