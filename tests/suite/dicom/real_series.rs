//! Real series. The expected values come from pydicom and numpy.

use std::path::Path;

use bevy::math::{DVec3, UVec3, Vec3};
use bevy_contextual_ao::volume::{
    Intensities, Volume,
    dicom::{Dicom, DicomProgress, DicomReadSettings, DicomUnit, Reason, read_dicom},
};

use super::{
    properties::read,
    written::{self, Syntax, numbers, short, text},
};
use crate::{needs::shared_volumes, small_files::Scratch};

pub fn list(path: &Path) -> Dicom {
    read_dicom(&[path]).unwrap_or_else(|error| panic!("{error}"))
}

/// The largest volume in a folder.
pub fn largest(path: &Path) -> Volume {
    let dicom = list(path);
    assert!(!dicom.series.is_empty(), "{:?}", dicom.left_out);
    read(&dicom.series[0].volumes[0])
}

struct Expected {
    folder: &'static str,
    dimensions: [u32; 3],
    spacing: [f32; 3],
    /// Place of the first voxel in the patient, RAS+.
    first: [f64; 3],
    /// Place of the last voxel of the first column.
    last: [f64; 3],
    range: [f64; 2],
    /// Sum of all values in file units.
    sum: f64,
    voxel: ([u32; 3], f64),
    unit: DicomUnit,
}

#[test]
#[rustfmt::skip]
fn real_series_are_as_pydicom_sees_them() {
    let Some(folder) = shared_volumes() else { return };
    let head = |folder, sum, middle| Expected { folder, dimensions: [256, 256, 4], spacing: [1.0; 3], first: [100.794158, 161.074673, 130.051254], last: [103.794158, 161.074673, 130.051254], range: [0.0, 254.0], sum, voxel: ([128, 128, 2], middle), unit: DicomUnit::Unknown };
    let table = [
        Expected { folder: "mr_adc_oblique", dimensions: [256, 256, 20], spacing: [0.7031, 0.7031, 3.0], first: [90.0225, 108.462, -43.9748], last: [90.1918, 118.372, 12.1567], range: [0.0, 4095.0], sum: 714_203_068.0, voxel: ([128, 128, 10], 1804.0), unit: DicomUnit::Unknown },
        head("hard_cases/uncompressed", 33_296_710.0, 90.0),
        head("hard_cases/compressed_rle", 33_304_746.0, 14.0),
        head("hard_cases/compressed_jpeg", 33_304_746.0, 14.0),
        head("hard_cases/compressed_jpegls", 33_304_746.0, 14.0),
        head("hard_cases/compressed_j2k", 33_304_746.0, 14.0),
        // Maps of blood flow, although CT: the file says that their unit is unspecified.
        Expected { folder: "hard_cases/enhanced_ct", dimensions: [512, 512, 2], spacing: [0.388672, 0.388672, 10.0], first: [-99.5, 301.5, -149.0], last: [-99.5, 301.5, -159.0], range: [-1024.0, 172.0], sum: -337_621_504.0, voxel: ([256, 256, 1], 81.0), unit: DicomUnit::Unknown },
        Expected { folder: "hard_cases/enhanced_mr_philips", dimensions: [256, 256, 8], spacing: [1.0, 1.0, 1.2], first: [-100.293579, 150.604593, 116.949244], last: [-91.893539, 150.604593, 116.949244], range: [0.0, 1081.748473748], sum: 283_923_481.084_248_5, voxel: ([128, 128, 4], 545.133089133), unit: DicomUnit::Unknown },
        Expected { folder: "hard_cases/legacy_enhanced_and_single/image", dimensions: [23, 38, 3], spacing: [0.7, 0.7, 2.5], first: [-46.4649, -5.01881, -177.75], last: [-46.4649, -5.01881, -172.75], range: [0.0, 1.0], sum: 310.0, voxel: ([11, 19, 1], 1.0), unit: DicomUnit::Unknown },
        Expected { folder: "hard_cases/legacy_enhanced_and_single/multiframe", dimensions: [23, 38, 3], spacing: [0.7, 0.7, 2.5], first: [-46.4649, -5.01881, -177.75], last: [-46.4649, -5.01881, -172.75], range: [0.0, 1.0], sum: 310.0, voxel: ([11, 19, 1], 1.0), unit: DicomUnit::Unknown },
    ];
    for expected in table {
        let name = expected.folder;
        let dicom = list(&folder.join("dicom").join(name));
        let listed = &dicom.series[0].volumes[0];
        assert_eq!(listed.unit(), expected.unit, "{name}");
        assert!(listed.warnings().is_empty(), "{name}: {:?}", listed.warnings());
        let volume = read(listed);
        assert_eq!(volume.dimensions(), UVec3::from_array(expected.dimensions), "{name}");
        assert!(volume.spacing_mm().abs_diff_eq(Vec3::from_array(expected.spacing), 1e-5), "{name}: {}", volume.spacing_mm());
        // Positions are cited with six decimals.
        let first = volume.grid_to_patient().translation;
        let last = volume.grid_to_patient().transform_point3(DVec3::new(0.0, 0.0, f64::from(expected.dimensions[2]) - 1.0));
        for (found, expected) in [(first, expected.first), (last, expected.last)] {
            assert!(found.abs_diff_eq(DVec3::from_array(expected), 1e-5), "{name}: {found}");
        }
        for (found, expected) in volume.range().into_iter().zip(expected.range) {
            assert!((found - expected).abs() < 1e-6, "{name}: {found}");
        }
        let count = volume.voxel_count() as usize;
        let sum: f64 = (0..count).filter_map(|at| volume.intensities().get(at)).map(|stored| volume.to_file_units(stored.into())).sum();
        // Doubles are rounded at every voxel.
        assert!((sum - expected.sum).abs() < 1e-12 * expected.sum.abs() * count as f64, "{name}: {sum}");
        let (voxel, value) = expected.voxel;
        let found = volume.value_at(UVec3::from_array(voxel)).unwrap();
        assert!((found - value).abs() < 1e-6, "{name}: {found}");
    }
}

#[test]
fn one_head_is_identical_in_every_transfer_syntax() {
    let Some(folder) = shared_volumes() else { return };
    let folder = folder.join("dicom/hard_cases");
    let first = largest(&folder.join("compressed_jpeg"));
    for other in ["compressed_rle", "compressed_jpegls", "compressed_j2k"] {
        assert_eq!(largest(&folder.join(other)), first, "{other}");
    }
    // The folder `uncompressed` holds another picture of this head; so the fifth is written here.
    let Intensities::U16(values) = first.intensities() else { panic!("12 bits") };
    for syntax in Syntax::ALL {
        let scratch = Scratch::new(&format!("dicom_head_{syntax:?}"));
        for (z, slice) in (0u32..).zip(values.chunks_exact(256 * 256)) {
            let at = first.grid_to_patient().transform_point3(DVec3::Z * f64::from(z));
            let bytes: Vec<u8> = slice.iter().flat_map(|value| value.to_le_bytes()).collect();
            let fields = vec![
                text(0x0020_000e, "UI", "1.2.3"),
                text(0x0008_0060, "CS", "MR"),
                numbers(0x0020_0032, &[-at.x, -at.y, at.z]),
                numbers(0x0020_0037, &[0.0, 1.0, 0.0, 0.0, 0.0, -1.0]),
                numbers(0x0028_0030, &[1.0, 1.0]),
                short(0x0028_0010, 256),
                short(0x0028_0011, 256),
                short(0x0028_0100, 16),
                short(0x0028_0101, 12),
                short(0x0028_0102, 11),
                short(0x0028_0103, 0),
            ];
            scratch.write(&z.to_string(), &written::file(syntax, fields, &[bytes], 2));
        }
        assert_eq!(largest(&scratch.0).intensities(), first.intensities(), "{syntax:?}");
    }
}

#[test]
fn a_tilted_gantry_is_a_sheared_grid_and_uneven_steps_are_even() {
    let Some(folder) = shared_volumes() else { return };
    let dicom = list(&folder.join("dicom/ge_ct_tilt"));
    let listed = &dicom.series[0].volumes[0];
    let steps = "13 of 4.00 mm, 1 of 1.08 mm, 13 of 7.00 mm";
    assert!(listed.warnings().concat().contains(steps), "{:?}", listed.warnings());
    assert_eq!(listed.unit(), DicomUnit::Hounsfield);
    let volume = read(listed);
    // 151.94 mm along the table; the smallest step there is 1.14 mm.
    assert_eq!(volume.dimensions(), UVec3::new(512, 512, 134));
    let matrix = volume.grid_to_patient().matrix3;
    // Slices follow each other along the table, and rows are tilted against it by the gantry's 18.5 degrees.
    let step = 151.94 / 133.0;
    assert!(matrix.z_axis.abs_diff_eq(DVec3::new(0.0, 0.0, step), 1e-9), "{}", matrix.z_axis);
    let tilt = matrix.y_axis.angle_between(DVec3::NEG_Y).to_degrees();
    assert!((tilt - 18.5).abs() < 0.01, "{tilt}");
    // The first and the last slice are as in the files. pydicom finds these values.
    for (voxel, value) in [([256, 256, 0], 997.0), ([256, 256, 133], 3.0)] {
        assert_eq!(volume.value_at(UVec3::from_array(voxel)), Some(value));
    }
    // Padding of -1500 lies below all real values, and is the lowest of them.
    assert_eq!(volume.background_voxels(), 1_741_040);
    assert_eq!(volume.range()[0], -1023.0);
}

#[test]
fn every_file_is_read_or_refused_by_name() {
    let Some(folder) = shared_volumes() else { return };
    let folder = folder.join("dicom");
    let dicom = list(&folder);
    let mut slices = 0;
    for volume in dicom.series.iter().flat_map(|series| &series.volumes) {
        slices += volume.slices();
        read(volume);
    }
    // 28 CT, 20 ADC, two heads of 4, 2 and 8 frames, 4 with slopes, 4 with a gap, 3 single and 3 frames.
    assert_eq!(slices, 28 + 20 + 2 * 4 + 2 + 8 + 4 + 4 + 3 + 3);
    let name = |path: &Path| path.strip_prefix(&folder).unwrap().to_string_lossy().into_owned();
    let count = |is: fn(&Reason) -> bool| dicom.left_out.iter().filter(|one| is(&one.reason)).count();
    assert_eq!(count(|reason| matches!(reason, Reason::NotDicom)), 6, "licences");
    assert_eq!(count(|reason| matches!(reason, Reason::Index)), 2, "DICOMDIRs");
    assert_eq!(count(|reason| matches!(reason, Reason::Localizer)), 1);
    assert_eq!(count(|reason| matches!(reason, Reason::SecondaryCapture)), 3);
    assert_eq!(count(|reason| matches!(reason, Reason::Colour(_))), 3);
    assert_eq!(count(|reason| matches!(reason, Reason::Segmentation)), 1);
    // One head in three other syntaxes.
    assert_eq!(count(|reason| matches!(reason, Reason::Duplicate { .. })), 3 * 4);
    // These four files have no functional groups.
    assert_eq!(count(|reason| matches!(reason, Reason::NoPlace("ImagePositionPatient"))), 4);
    let names: Vec<_> = dicom.left_out.iter().map(|one| name(&one.path)).collect();
    assert_eq!(dicom.left_out.len(), 6 + 2 + 1 + 3 + 3 + 1 + 12 + 4, "{names:?}");
}

#[test]
fn a_dicomdir_finds_files_beside_it() {
    let Some(folder) = shared_volumes() else { return };
    // Its names begin with a folder that the copy lacks.
    let dicom = list(&folder.join("dicom/phantom_mixed_dicomdir/S4010/DIRFILE"));
    assert!(dicom.series.is_empty());
    assert_eq!(dicom.left_out.len(), 6);
    assert!(!dicom.left_out.iter().any(|one| matches!(one.reason, Reason::NotThere)), "{:?}", dicom.left_out);
}

#[test]
fn the_budget_is_counted_before_decoding() {
    let Some(folder) = shared_volumes() else { return };
    let dicom = list(&folder.join("dicom/ge_ct_tilt"));
    let listed = &dicom.series[0].volumes[0];
    // 28 slices take about 34 MB at 4.8 bytes a voxel: with 40 MB the step is coarser than with 4 GB.
    let settings = DicomReadSettings { max_bytes: 40_000_000, ..Default::default() };
    let grid = listed.grid(&settings).unwrap();
    assert!((28..34).contains(&grid.dimensions.z), "{grid:?}");
    let progress = DicomProgress::default();
    let settings = DicomReadSettings { max_bytes: 1_000_000, ..Default::default() };
    let refused = listed.read(&settings, &progress).expect_err("a slice takes more");
    assert!(refused.to_string().contains("max_bytes allows 1 MiB"), "{refused}");
    assert_eq!(progress.total(), 0, "it began to decode");
    progress.cancel();
    let cancelled = listed.read(&DicomReadSettings::default(), &progress).expect_err("cancelled");
    assert!(cancelled.to_string().contains("cancelled"), "{cancelled}");
}
