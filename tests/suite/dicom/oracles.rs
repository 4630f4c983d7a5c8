//! Other readers' results: dcm2niix for places and values, pydicom for pixels.

use std::{fs, path::Path, process::Command};

use bevy::math::{DVec3, UVec3};
use bevy_contextual_ao::volume::{Volume, read_volume_file};
use contextual_ao_kit::random::Random;

use super::{real_series::largest, scan::Scan, written::Syntax};
use crate::{
    needs::{program, shared_volumes},
    small_files::Scratch,
};

/// Series without a gantry's tilt and with even steps, which dcm2niix keeps as they are.
const SERIES: [&str; 9] = [
    "mr_adc_oblique",
    "hard_cases/uncompressed",
    "hard_cases/compressed_rle",
    "hard_cases/compressed_jpeg",
    "hard_cases/enhanced_ct",
    "hard_cases/enhanced_mr_philips",
    "hard_cases/per_slice_slope",
    "hard_cases/legacy_enhanced_and_single/image",
    "hard_cases/legacy_enhanced_and_single/multiframe",
];

#[test]
fn places_and_values_are_those_of_dcm2niix() {
    let (Some(folder), Some(_)) = (shared_volumes(), program("DCM2NIIX", "dcm2niix", &["-v"])) else {
        return;
    };
    for name in SERIES {
        let scratch = Scratch::new(&format!("dcm2niix_{}", name.replace('/', "_")));
        let mut convert = program("DCM2NIIX", "dcm2niix", &["-v"]).expect("it was there");
        let from = folder.join("dicom").join(name);
        let ran = convert.args(["-z", "n", "-b", "n", "-f", "converted", "-o"]).arg(&scratch.0).arg(&from);
        assert!(ran.output().expect("it runs").status.success(), "{name}");
        let converted = read_volume_file(&scratch.0.join("converted.nii")).unwrap();
        let volume = largest(&from);
        assert_eq!(converted.voxel_count(), volume.voxel_count(), "{name}");
        // Ours to theirs: the same places in another order of rows. Theirs are rounded to f32.
        let to_theirs = converted.grid_to_patient().inverse() * volume.grid_to_patient();
        // dcm2niix has Philips' own unit, by a private field.
        let unit = if name.ends_with("philips") { converted.range()[1] / volume.range()[1] } else { 1.0 };
        // Slopes that differ are brought to one by both.
        let step = volume.rescale().slope.abs() + converted.rescale().slope.abs();
        let size = volume.dimensions();
        for index in 0..size.element_product() {
            let at = UVec3::new(index % size.x, index / size.x % size.y, index / size.x / size.y);
            let place = to_theirs.transform_point3(at.as_dvec3());
            assert!(place.abs_diff_eq(place.round(), 2e-3), "{name}: {at} is {place} of dcm2niix");
            let found = volume.value_at(at).unwrap();
            let theirs = converted.value_at(place.round().as_uvec3()).unwrap() / unit;
            // Their slopes are rounded to f32.
            let tolerance = if name.ends_with("slope") { step } else { 1e-3 };
            assert!((found - theirs).abs() <= tolerance, "{name} at {at}: {found}, not {theirs}");
        }
    }
}

/// Writes all slices of a folder, in order along their normal: the first corner of each, then its values, as doubles.
const SCRIPT: &str = r#"
import os, sys, numpy, pydicom
slices = []
for root, _, names in os.walk(sys.argv[1]):
    for name in names:
        try:
            file = pydicom.dcmread(os.path.join(root, name))
            pixels = file.pixel_array
        except Exception:
            continue
        frames = pixels if pixels.ndim == 3 else pixels[None]
        for index, frame in enumerate(frames):
            def group(name):
                if 'PerFrameFunctionalGroupsSequence' not in file:
                    return file
                for groups in (file.PerFrameFunctionalGroupsSequence[index], file.SharedFunctionalGroupsSequence[0]):
                    if name in groups:
                        return groups[name][0]
            at = numpy.array(group('PlanePositionSequence').ImagePositionPatient, float)
            axes = numpy.array(group('PlaneOrientationSequence').ImageOrientationPatient, float)
            scale = group('PixelValueTransformationSequence')
            values = frame * float(scale.get('RescaleSlope', 1)) + float(scale.get('RescaleIntercept', 0))
            slices.append((at @ numpy.cross(axes[:3], axes[3:]), at, values))
slices.sort(key=lambda slice: slice[0])
with open(sys.argv[2], 'wb') as out:
    for _, at, values in slices:
        out.write(at.astype('<f8').tobytes() + values.astype('<f8').tobytes())
"#;

fn pydicom() -> Option<Command> {
    program("PYDICOM", "python3", &["-c", "import pydicom"])
}

/// Compares a volume with pydicom's slices of its folder.
fn compare(volume: &Volume, folder: &Path, scratch: &Scratch, tolerance: f64) {
    let out = scratch.0.join("values.f64");
    let script = scratch.write("slices.py", SCRIPT.as_bytes());
    let ran = pydicom().expect("it was there").arg(script).arg(folder).arg(&out).output().expect("it runs");
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let bytes = fs::read(out).unwrap();
    let mut numbers = bytes.as_chunks::<8>().0.iter().map(|&eight| f64::from_le_bytes(eight));
    let size = volume.dimensions();
    for z in 0..size.z {
        let corner = DVec3::from_array([(); 3].map(|()| numbers.next().expect("a corner")));
        let found = volume.grid_to_patient().transform_point3(DVec3::Z * f64::from(z));
        let found = DVec3::new(-found.x, -found.y, found.z);
        // A hundredth of the step is allowed to a slice.
        assert!(found.abs_diff_eq(corner, 0.01 * f64::from(volume.spacing_mm().z)), "{found}, not {corner}");
        for y in 0..size.y {
            for x in 0..size.x {
                let (at, expected) = (UVec3::new(x, y, z), numbers.next().expect("a value"));
                let found = volume.value_at(at).unwrap();
                assert!((found - expected).abs() <= tolerance, "{at}: {found}, not {expected}: {folder:?}");
            }
        }
    }
    assert_eq!(numbers.next(), None, "pydicom finds more slices");
}

#[test]
fn pixels_are_those_of_pydicom() {
    let (Some(folder), Some(_)) = (shared_volumes(), pydicom()) else { return };
    for name in SERIES.into_iter().chain(["hard_cases/compressed_jpegls", "hard_cases/compressed_j2k"]) {
        let scratch = Scratch::new(&format!("pydicom_{}", name.replace('/', "_")));
        let from = folder.join("dicom").join(name);
        let volume = largest(&from);
        // Where slopes differ, values are rounded to the nearest of 65536.
        let tolerance = if name.ends_with("slope") { 0.5 * volume.rescale().slope } else { 0.0 };
        compare(&volume, &from, &scratch, tolerance + 1e-9);
    }
}

#[test]
fn files_written_by_these_tests_are_dicom_to_pydicom() {
    if pydicom().is_none() {
        return;
    }
    let mut random = Random(31);
    for (round, syntax) in (0..).zip(Syntax::ALL.repeat(3)) {
        let scratch = Scratch::new(&format!("pydicom_written_{round}"));
        // pydicom shows numbers as they lie in their words: only those at the lowest bits are the values.
        let mut scan = Scan { syntax, ..Scan::random(&mut random) };
        scan.high_bit = scan.bits_stored - 1;
        let files = scratch.0.join("files");
        fs::create_dir_all(&files).unwrap();
        if round % 2 == 0 {
            let order: Vec<u32> = (0..scan.size.z).rev().collect();
            fs::write(files.join("frames"), scan.multi_frame(&order)).unwrap();
        } else {
            (0..scan.size.z).for_each(|z| fs::write(files.join(z.to_string()), scan.slice(z, z)).unwrap());
        }
        compare(&largest(&files), &files, &scratch, 1e-9);
    }
}
