//! Scans at random are read as they were written.

use std::{collections::BTreeMap, path::PathBuf};

use bevy::math::UVec3;
use bevy_contextual_ao::volume::{
    Volume,
    dicom::{
        Dicom, DicomProgress, DicomReadSettings, DicomUnit, DicomVolume, Reason, UnevenSlices, read_dicom,
    },
};
use contextual_ao_kit::random::Random;

use super::{
    scan::Scan,
    written::{Field, Syntax, numbers, text},
};
use crate::small_files::Scratch;

/// Rounding of values in doubles: they are below 200000.
const ROUNDING: f64 = 1e-9;

fn shuffled(random: &mut Random, count: u32) -> Vec<u32> {
    let mut order: Vec<u32> = (0..count).collect();
    for index in (1..order.len()).rev() {
        order.swap(index, random.below(index + 1));
    }
    order
}

/// Writes slices under names that say nothing, in folders within each other.
fn write(scratch: &Scratch, files: Vec<Vec<u8>>) -> PathBuf {
    std::fs::create_dir_all(scratch.0.join("scan/deeper")).unwrap();
    for (index, bytes) in files.into_iter().enumerate() {
        let folder = if index % 2 == 0 { "scan" } else { "scan/deeper" };
        scratch.write(&format!("{folder}/{index}"), &bytes);
    }
    scratch.0.join("scan")
}

fn list(path: PathBuf) -> Dicom {
    read_dicom(&[path]).unwrap_or_else(|error| panic!("{error}"))
}

pub fn read(volume: &DicomVolume) -> Volume {
    let progress = DicomProgress::default();
    let read =
        volume.read(&DicomReadSettings::default(), &progress).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!([progress.done(), progress.total()], [volume.slices(); 2]);
    read
}

/// The only volume of the only series.
fn only(dicom: &Dicom) -> &DicomVolume {
    let [series] = &dicom.series[..] else { panic!("{dicom:?}") };
    let [volume] = &series.volumes[..] else { panic!("{dicom:?}") };
    volume
}

#[test]
fn a_scan_is_read_as_written() {
    let mut random = Random(11);
    for round in 0..80 {
        let scratch = Scratch::new(&format!("dicom_scan_{round}"));
        let scan = Scan::random(&mut random);
        let order = shuffled(&mut random, scan.size.z);
        let mut files: Vec<_> = order.iter().map(|&z| scan.slice(z, z)).collect();
        files.push(scan.slice(order[0], order[0]));
        files.extend(scan.others().into_iter().map(|(_, bytes)| bytes));
        let dicom = list(write(&scratch, files));
        let volume = only(&dicom);
        scan.check(&read(volume), ROUNDING, |at| scan.in_units(at));
        assert!(volume.warnings().is_empty(), "{:?}", volume.warnings());
        let mut reasons = BTreeMap::new();
        for one in &dicom.left_out {
            let reason = match one.reason {
                Reason::Duplicate { .. } => "duplicate",
                Reason::Localizer => "localizer",
                Reason::NoPixels { .. } => "report",
                Reason::NotDicom => "text",
                _ => "other",
            };
            *reasons.entry(reason).or_insert(0) += 1;
        }
        let expected = [("duplicate", 1), ("localizer", 1), ("report", 1), ("text", 1)];
        assert_eq!(reasons, BTreeMap::from(expected), "{:?}", dicom.left_out);
    }
}

#[test]
fn frames_of_one_file_are_the_slices_of_many() {
    let mut random = Random(12);
    for round in 0..40 {
        let scratch = Scratch::new(&format!("dicom_frames_{round}"));
        let scan = Scan::random(&mut random);
        let order = shuffled(&mut random, scan.size.z);
        let path = scratch.write("frames", &scan.multi_frame(&order));
        scan.check(&read(only(&list(path))), ROUNDING, |at| scan.in_units(at));
    }
}

#[test]
fn a_missing_slice_is_interpolated_with_a_warning_or_refused() {
    let mut random = Random(13);
    for round in 0..40 {
        let scratch = Scratch::new(&format!("dicom_missing_{round}"));
        let mut scan = Scan::random(&mut random);
        while scan.size.z < 5 {
            scan = Scan::random(&mut random);
        }
        // The neighbours of the second are a step and two steps apart.
        let missing = 2;
        let files = (0..scan.size.z).filter(|&z| z != missing).map(|z| scan.slice(z, z)).collect();
        let dicom = list(write(&scratch, files));
        let volume = only(&dicom);
        let warning = volume.warnings().concat();
        let step = scan.step.dot(scan.axes[0].cross(scan.axes[1]));
        for length in [step, 2.0 * step] {
            assert!(warning.contains(&format!("{length:.2} mm")), "{warning}");
        }
        // A number between two may be rounded by half a step.
        let tolerance = 0.5 * scan.rescale[0][0] + ROUNDING;
        scan.check(&read(volume), tolerance, |at| {
            if at.z == missing {
                let beside = [missing - 1, missing + 1].map(|z| UVec3 { z, ..at });
                beside.map(|at| scan.in_units(at)).iter().sum::<f64>() / 2.0
            } else {
                scan.in_units(at)
            }
        });
        let refuse = DicomReadSettings { uneven: UnevenSlices::Refuse, ..Default::default() };
        let refused = volume.read(&refuse, &DicomProgress::default()).expect_err("a slice is missing");
        assert!(refused.to_string().contains("must be even"), "{refused}");
    }
}

#[test]
fn slopes_of_slices_become_one() {
    let mut random = Random(14);
    for round in 0..40 {
        let scratch = Scratch::new(&format!("dicom_slopes_{round}"));
        let mut scan = Scan::random(&mut random);
        for rescale in &mut scan.rescale {
            *rescale = [0.01 + f64::from(random.share()), f64::from(random.signed()) * 100.0];
        }
        let files = (0..scan.size.z).map(|z| scan.slice(z, z)).collect();
        let volume = read(only(&list(write(&scratch, files))));
        // The range of all values has 65535 steps.
        let values: Vec<f64> = scan.voxels().map(|at| scan.in_units(at)).collect();
        let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(a, b), &x| (a.min(x), b.max(x)));
        scan.check(&volume, 0.5 * (high - low) / 65_535.0 + ROUNDING, |at| scan.in_units(at));
    }
}

#[test]
fn padding_is_air_and_dark_is_bright() {
    let mut random = Random(15);
    for round in 0..40 {
        let scratch = Scratch::new(&format!("dicom_padding_{round}"));
        let mut scan = Scan { syntax: Syntax::Explicit, modality: "MR", ..Scan::random(&mut random) };
        let padding = *scan.values.iter().min().unwrap();
        scan.padding = Some(padding);
        scan.photometric = random.pick(&["MONOCHROME1", "MONOCHROME2"]);
        let files = (0..scan.size.z).map(|z| scan.slice(z, z)).collect();
        let dicom = list(write(&scratch, files));
        let volume = read(only(&dicom));
        let sign = if scan.photometric == "MONOCHROME1" { -1.0 } else { 1.0 };
        let is_padding = |at: UVec3| scan.value(at) == padding;
        let real = scan.voxels().filter(|&at| !is_padding(at)).map(|at| sign * scan.in_units(at));
        let air = real.fold(f64::MAX, f64::min);
        scan.check(&volume, ROUNDING, |at| if is_padding(at) { air } else { sign * scan.in_units(at) });
        assert_eq!(volume.background_voxels(), scan.voxels().filter(|&at| is_padding(at)).count() as u64);
    }
}

#[test]
fn echoes_are_volumes_of_one_series() {
    let scratch = Scratch::new("dicom_echoes");
    let mut random = Random(16);
    let first = Scan { echo_ms: 4.5, ..Scan::random(&mut random) };
    let mut second = Scan { echo_ms: 12.0, ..first.clone() };
    second.values.reverse();
    let files = (0..first.size.z).flat_map(|z| [second.slice(z, 2 * z), first.slice(z, 2 * z + 1)]).collect();
    let dicom = list(write(&scratch, files));
    let [series] = &dicom.series[..] else { panic!("{dicom:?}") };
    let labels: Vec<_> = series.volumes.iter().map(DicomVolume::label).collect();
    assert_eq!(labels, ["echo time 4.5", "echo time 12"]);
    for (scan, volume) in [first, second].iter().zip(&series.volumes) {
        scan.check(&read(volume), ROUNDING, |at| scan.in_units(at));
    }
}

#[test]
fn slices_that_no_field_tells_apart_are_volumes_by_number_with_a_warning() {
    let scratch = Scratch::new("dicom_passes");
    let first = Scan::random(&mut Random(18));
    let mut second = first.clone();
    second.values.reverse();
    // Their InstanceNumbers fall with these identifiers.
    let files = (0..first.size.z).flat_map(|z| [second.slice(z, z), first.slice(z, 100 + z)]).collect();
    let dicom = list(write(&scratch, files));
    let [series] = &dicom.series[..] else { panic!("{dicom:?}") };
    for (scan, volume) in [first, second].iter().zip(&series.volumes) {
        assert!(volume.warnings().concat().contains("no field tells them apart"), "{:?}", volume.warnings());
        scan.check(&read(volume), ROUNDING, |at| scan.in_units(at));
    }
}

#[test]
fn pet_is_in_suv_where_the_header_allows_it() {
    let mut random = Random(19);
    let dose = vec![
        text(0x0018_1072, "TM", "100000"),
        text(0x0018_1074, "DS", "370000000"),
        text(0x0018_1075, "DS", "6586.2"),
    ];
    let all = [
        text(0x0054_1001, "CS", "BQML"),
        text(0x0028_0051, "CS", "NORM\\DECY\\ATTN"),
        text(0x0054_1102, "CS", "START"),
        text(0x0008_0021, "DA", "20200101"),
        text(0x0008_0031, "TM", "110000.00"),
        text(0x0010_1030, "DS", "70"),
        Field::Items(0x0054_0016, vec![dose]),
        numbers(0x0028_1050, &[10_000.0]),
        numbers(0x0028_1051, &[20_000.0]),
    ];
    // An hour of decay before the scan.
    let suv = 70.0 * 1000.0 / (3.7e8 * 0.5f64.powf(3600.0 / 6586.2));
    for (missing, reason) in [(9, ""), (1, "ATTN or DECY"), (4, "SeriesTime"), (5, "PatientWeight")] {
        let scratch = Scratch::new(&format!("dicom_pet_{missing}"));
        let mut more = all.to_vec();
        if missing < more.len() {
            more.remove(missing);
        }
        let scan = Scan { modality: "PT", more, ..Scan::random(&mut random) };
        let files = (0..scan.size.z).map(|z| scan.slice(z, z)).collect();
        let dicom = list(write(&scratch, files));
        let listed = only(&dicom);
        let volume = read(listed);
        let factor = if reason.is_empty() { suv } else { 1.0 };
        scan.check(&volume, ROUNDING, |at| factor * scan.in_units(at));
        if reason.is_empty() {
            assert_eq!(listed.unit(), DicomUnit::Suv);
        } else {
            assert_eq!(listed.unit(), DicomUnit::Other("BQML".into()));
            assert!(listed.warnings().concat().contains(reason), "{:?}", listed.warnings());
        }
        // The window is in the volume's unit, and is the first look.
        let look = listed.first_look(&volume);
        let [from, to] = [look.points.first(), look.points.last()].map(|point| point.unwrap().value);
        assert!(from.abs() < 1e-6 && (f64::from(to) - 20_000.0 * factor).abs() < 1e-2, "{from} to {to}");
    }
}

#[test]
fn nothing_of_the_patient_is_printed() {
    let scratch = Scratch::new("dicom_patient");
    let scan = Scan::random(&mut Random(17));
    let mut files: Vec<_> = (0..scan.size.z).map(|z| scan.slice(z, z)).collect();
    files.extend(scan.others().into_iter().map(|(_, bytes)| bytes));
    let dicom = list(write(&scratch, files));
    let printed = format!("{dicom:?} {} {:?}", dicom.series[0], read(only(&dicom)));
    assert!(!printed.contains("Secret") && !printed.contains("1901"), "{printed}");
}

#[test]
fn a_slice_alone_is_that_of_the_volume() {
    let mut random = Random(97);
    for case in 0..40 {
        let scratch = Scratch::new(&format!("dicom_slice_{case}"));
        let scan = Scan::random(&mut random);
        // One file of all slices, or a file for each.
        let order = shuffled(&mut random, scan.size.z);
        let files = match random.flip() {
            true => vec![scan.multi_frame(&order)],
            false => order.iter().map(|&z| scan.slice(z, z)).collect(),
        };
        let listed = list(write(&scratch, files));
        let volume = only(&listed);
        for z in 0..scan.size.z {
            let slice = volume.slice(z as usize).unwrap_or_else(|error| panic!("{error}: {scan:?}"));
            assert_eq!(slice.size, scan.size.truncate());
            assert!(slice.spacing_mm.as_dvec2().abs_diff_eq(scan.spacing.into(), 1e-6));
            let expected = scan.voxels().filter(|at| at.z == z).map(|at| scan.in_units(at));
            for (found, expected) in slice.values.iter().zip(expected) {
                // Singles have seven digits.
                assert!((f64::from(*found) - expected).abs() < 0.02, "{found}, not {expected}: {scan:?}");
            }
        }
        let beyond = volume.slice(scan.size.z as usize).expect_err("there is no more");
        assert!(beyond.to_string().contains("counted from 0"), "{beyond}");
    }
}
